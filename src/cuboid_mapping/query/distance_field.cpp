// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/distance_field.h"

#include "cuboid_mapping/query/obstacles.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <stdexcept>
#include <string>

namespace cuboid_mapping {
namespace {

/// No obstacle within the bound: its square is kFar, which no square of an offset reaches.
constexpr std::int8_t kNoOffset = -128;
constexpr std::int16_t kFar = 128 * 128;

CellBox inflate(const CellBox& box, std::int32_t by) {
  return {box.min - Cell{by, by, by}, box.max + Cell{by, by, by}};
}

/// A voxel for each row of a box.
CellBox flagsOf(CellBox box) {
  box.max.x = box.min.x + 1;
  return box;
}

/// The region with its surroundings. @throws std::invalid_argument
CellBox checkedSurroundings(const CellBox& region, double bound) {
  if (!(bound > 0.0 && bound <= DistanceField::kMaxBound)) {
    throw std::invalid_argument(
        "the bound of a distance field must be more than 0 and at most 127 voxels, not " +
        std::to_string(bound));
  }
  const CellBox around = inflate(region, static_cast<std::int32_t>(bound + 1e-6));
  if (region.isEmpty() || around.numVoxels() > DistanceField::kMaxVoxels) {
    throw std::invalid_argument(
        "the region of a distance field must not be empty, and have at most 1e9 voxels with its "
        "surroundings up to the bound, not " +
        std::to_string(around.numVoxels()) + ": choose another one");
  }
  return around;
}

std::int16_t squareOf(std::int32_t offset) { return static_cast<std::int16_t>(offset * offset); }

/// Least of what is there and of squares with another one added, place by place. All are at most kFar, and the
/// other one at most 127 squared: the sums fit. The values are offsets, or squares.
///@{
void lessen(std::int16_t* least, const std::int8_t* offsets, std::size_t size, std::int16_t added) {
  for (std::size_t i = 0; i < size; ++i) {
    const auto sum = static_cast<std::int16_t>(squareOf(offsets[i]) + added);
    least[i] = std::min(least[i], sum);
  }
}
void lessen(std::int16_t* least, const std::int16_t* squares, std::size_t size,
            std::int16_t added) {
  for (std::size_t i = 0; i < size; ++i) {
    const auto sum = static_cast<std::int16_t>(squares[i] + added);
    least[i] = std::min(least[i], sum);
  }
}
///@}

/// Offsets of the places of a row to the nearest obstacle. @param obstacles  Where they are, ascending.
/// @param first  The first place.
void findOffsets(const std::vector<std::int32_t>& obstacles, std::int32_t first, std::int32_t bound,
                 std::vector<std::int8_t>& offsets) {
  std::fill(offsets.begin(), offsets.end(), kNoOffset);
  if (obstacles.empty()) return;
  std::size_t nearest = 0;
  for (std::size_t i = 0; i < offsets.size(); ++i) {
    const std::int32_t at = first + static_cast<std::int32_t>(i);
    while (nearest + 1 < obstacles.size() &&
           std::abs(obstacles[nearest + 1] - at) < std::abs(obstacles[nearest] - at)) {
      ++nearest;
    }
    const std::int32_t offset = obstacles[nearest] - at;
    if (std::abs(offset) <= bound) offsets[i] = static_cast<std::int8_t>(offset);
  }
}

}  // namespace

DistanceField::DistanceField(const CuboidMap& map, const CellBox& region, double bound_m,
                             UnknownPolicy policy)
    : grid_(map.grid()),
      region_(region),
      around_(checkedSurroundings(region, bound_m * grid_.inverseResolution())),
      bound_(region.min.x - around_.min.x),
      max_square_(static_cast<std::int16_t>(std::pow(bound_m * grid_.inverseResolution(), 2.0) *
                                            (1.0 + 1e-9))),
      policy_(policy),
      offsets_({{region.min.x, around_.min.y, around_.min.z},
                {region.max.x, around_.max.y, around_.max.z}},
               kNoOffset),
      layers_({{region.min.x, region.min.y, around_.min.z},
               {region.max.x, region.max.y, around_.max.z}},
              kFar),
      squares_(region, kFar),
      changed_rows_(flagsOf(offsets_.box), 0),
      changed_layers_(flagsOf(layers_.box), 0) {
  ChangeSet everything;
  everything.is_everything = true;
  update(map, everything);
}

void DistanceField::update(const CuboidMap& map, const ChangeSet& changes) {
  const Obstacles obstacles(map, policy_);
  std::set<std::pair<std::int32_t, std::int32_t>> rows_of_bricks;
  const auto add = [&](const Cell& brick) { rows_of_bricks.emplace(brick.z, brick.y); };
  if (changes.is_everything) {
    CellBox face = around_;
    face.max.x = face.min.x + 1;
    forEachBrick(face, add);
  }
  for (const ChangedBrick& changed : changes.bricks) {
    if (changed.has_new_cuboids && brickBox(changed.brick).intersects(around_)) add(changed.brick);
  }
  std::fill(changed_rows_.values.begin(), changed_rows_.values.end(), std::uint8_t{0});
  for (const auto& [brick_z, brick_y] : rows_of_bricks) {
    computeBrickRows(obstacles, brick_y, brick_z);
  }
  computeLayers();
  computeSquares();
}

/// The rows along x through some bricks.
void DistanceField::computeBrickRows(const Obstacles& obstacles, std::int32_t brick_y,
                                     std::int32_t brick_z) {
  std::vector<BrickMask> masks;
  const std::int32_t first_x = brickOf(around_.min).x;
  for (std::int32_t x = first_x; x < around_.max.x; x += kBrickEdge) {
    masks.push_back(obstacles.inBrick({x, brick_y, brick_z}));
  }
  std::vector<std::int32_t> found;
  std::vector<std::int8_t> offsets(static_cast<std::size_t>(region_.size().x));
  for (std::int32_t z = std::max(brick_z, around_.min.z);
       z < std::min(brick_z + kBrickEdge, around_.max.z); ++z) {
    for (std::int32_t y = std::max(brick_y, around_.min.y);
         y < std::min(brick_y + kBrickEdge, around_.max.y); ++y) {
      found.clear();
      for (std::size_t i = 0; i < masks.size(); ++i) {
        std::uint64_t left = masks[i][z & (kBrickEdge - 1)] >> (8 * (y & (kBrickEdge - 1))) & 0xFF;
        for (; left != 0; left &= left - 1) {
          found.push_back(first_x + static_cast<std::int32_t>(kBrickEdge * i) +
                          __builtin_ctzll(left));
        }
      }
      findOffsets(found, region_.min.x, bound_, offsets);
      std::int8_t* row = offsets_.row(y, z);
      if (std::equal(offsets.begin(), offsets.end(), row)) continue;
      std::copy(offsets.begin(), offsets.end(), row);
      *changed_rows_.row(y, z) = 1;
    }
  }
}

/// Squared distances in each layer: the least of the rows within the bound.
void DistanceField::computeLayers() {
  const auto width = static_cast<std::size_t>(region_.size().x);
  std::vector<std::int16_t> squares(width);
  for (std::int32_t z = around_.min.z; z < around_.max.z; ++z) {
    for (std::int32_t y = region_.min.y; y < region_.max.y; ++y) {
      const std::uint8_t* changed = changed_rows_.row(y - bound_, z);
      const bool is_near =
          std::find(changed, changed + 2 * bound_ + 1, 1) != changed + 2 * bound_ + 1;
      *changed_layers_.row(y, z) = 0;
      if (!is_near) continue;
      std::fill(squares.begin(), squares.end(), kFar);
      for (std::int32_t from = y - bound_; from <= y + bound_; ++from) {
        lessen(squares.data(), offsets_.row(from, z), width, squareOf(from - y));
      }
      std::int16_t* row = layers_.row(y, z);
      if (std::equal(squares.begin(), squares.end(), row)) continue;
      std::copy(squares.begin(), squares.end(), row);
      *changed_layers_.row(y, z) = 1;
    }
  }
}

/// Squared distances: the least of the layers within the bound.
void DistanceField::computeSquares() {
  const auto width = static_cast<std::size_t>(region_.size().x);
  for (std::int32_t z = region_.min.z; z < region_.max.z; ++z) {
    for (std::int32_t y = region_.min.y; y < region_.max.y; ++y) {
      bool is_near = false;
      for (std::int32_t from = z - bound_; from <= z + bound_ && !is_near; ++from) {
        is_near = *changed_layers_.row(y, from) != 0;
      }
      if (!is_near) continue;
      std::int16_t* row = squares_.row(y, z);
      std::fill(row, row + width, kFar);
      for (std::int32_t from = z - bound_; from <= z + bound_; ++from) {
        lessen(row, layers_.row(y, from), width, squareOf(from - z));
      }
    }
  }
}

std::optional<double> DistanceField::distanceAt(const Eigen::Vector3d& point_map) const {
  const auto cell = grid_.toCell(point_map);
  if (!cell || !region_.contains(*cell)) return std::nullopt;
  const std::int16_t square = squares_.at(*cell);
  if (square > max_square_) return std::numeric_limits<double>::infinity();
  return std::sqrt(static_cast<double>(square)) * grid_.resolution();
}

std::optional<Cell> DistanceField::findNearest(const Cell& cell) const {
  if (!region_.contains(cell) || squares_.at(cell) > max_square_) return std::nullopt;
  Cell nearest = cell;
  const auto is_from = [](std::int32_t whole, std::int32_t part, std::int32_t offset) {
    return part + offset * offset == whole;
  };
  nearest.z -= bound_;
  while (!is_from(squares_.at(cell), layers_.at(nearest), nearest.z - cell.z)) ++nearest.z;
  const std::int32_t in_layer = layers_.at(nearest);
  nearest.y -= bound_;
  while (!is_from(in_layer, squareOf(offsets_.at(nearest)), nearest.y - cell.y)) ++nearest.y;
  nearest.x += offsets_.at(nearest);
  return nearest;
}

std::optional<Eigen::Vector3d> DistanceField::gradientAt(const Eigen::Vector3d& point_map) const {
  const auto cell = grid_.toCell(point_map);
  if (!cell || !region_.contains(*cell)) return std::nullopt;
  const auto nearest = findNearest(*cell);
  if (!nearest || *nearest == *cell) return Eigen::Vector3d(Eigen::Vector3d::Zero());
  return Eigen::Vector3d((toVector(*cell) - toVector(*nearest)).normalized());
}

std::size_t DistanceField::numBytes() const {
  return offsets_.values.capacity() + 2 * (layers_.values.capacity() + squares_.values.capacity()) +
         changed_rows_.values.capacity() + changed_layers_.values.capacity();
}

}  // namespace cuboid_mapping
