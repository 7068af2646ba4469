// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/distance_field.h"

#include "cuboid_mapping/geometry/box_faces.h"
#include "cuboid_mapping/query/obstacles.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <set>
#include <stdexcept>
#include <string>

namespace cuboid_mapping {
namespace {

/// No obstacle within the bound: its square is kFar, which no square of an offset reaches.
constexpr std::int8_t kNoOffset = -128;
constexpr std::int16_t kFar = 128 * 128;

/// A voxel for each row of a box.
CellBox edgeOf(CellBox box) {
  box.max.x = box.min.x + 1;
  return box;
}

/// The region with its surroundings. @throws std::invalid_argument
CellBox checkedSurroundings(const Grid& grid, const CellBox& region, double bound_m) {
  const double bound = bound_m * grid.inverseResolution();
  if (!(bound > 0.0 && bound <= DistanceField::kMaxBound)) {
    throw std::invalid_argument(
        "the bound of a distance field must be more than 0 and at most 127 voxels, here " +
        std::to_string(DistanceField::kMaxBound * grid.resolution()) + " m, not " +
        std::to_string(bound_m) + " m");
  }
  const auto reach = static_cast<std::int32_t>(bound + 1e-6);
  const CellBox around = dilate(intersect(region, kAllCells), {reach, reach, reach});
  if (region.isEmpty() || !kAllCells.contains(region) ||
      around.numVoxels() > DistanceField::kMaxVoxels) {
    throw std::invalid_argument(
        "the region of a distance field must not be empty, lie within the limits of a map, and "
        "have at most 1e9 voxels with its surroundings up to the bound, not " +
        std::to_string(around.numVoxels()) + ": choose another one");
  }
  return around;
}

std::int16_t squareOf(std::int32_t offset) { return static_cast<std::int16_t>(offset * offset); }

/// Places of a row that are worked on at once: they fill a register.
constexpr std::int32_t kLanes = 8;
using Squares = std::int16_t __attribute__((vector_size(2 * kLanes)));

/// Squares of what rows hold from a place on: offsets, or squares, which are at most kFar.
///@{
Squares squaresAt(const std::int8_t* offsets) {
  std::int8_t __attribute__((vector_size(kLanes))) lanes;
  std::memcpy(&lanes, offsets, sizeof(lanes));
  const Squares wide = __builtin_convertvector(lanes, Squares);
  return wide * wide;
}
Squares squaresAt(const std::int16_t* squares) {
  Squares lanes;
  std::memcpy(&lanes, squares, sizeof(lanes));
  return lanes;
}
///@}

Squares lesser(const Squares& a, const Squares& b) { return a < b ? a : b; }

bool isAnyGreater(const Squares& lanes, std::int16_t limit) {
  std::uint64_t bits[2];
  const Squares are_greater = lanes > limit;
  std::memcpy(bits, &are_greater, sizeof(bits));
  return (bits[0] | bits[1]) != 0;
}

/// Least of the rows around one and of the squares of their distances from it, in a part of it and up to kLanes - 1
/// places around.
/// @param row_of  (int distance): the row so far before or behind. The sums fit: a distance is at most 127.
/// @param width  Of a row, at least kLanes.
template <typename PartT, typename RowOfT>
void findLeast(const PartT& part, std::int32_t width, std::int32_t bound, const RowOfT& row_of,
               std::int16_t* least) {
  for (std::int32_t begin = part.begin; begin < part.end; begin += kLanes) {
    const std::int32_t at = std::min(begin, width - kLanes);
    Squares lanes = squaresAt(row_of(0) + at);
    // Those farther away add more.
    for (std::int32_t distance = 1; distance <= bound && isAnyGreater(lanes, squareOf(distance));
         ++distance) {
      const Squares rows =
          lesser(squaresAt(row_of(-distance) + at), squaresAt(row_of(distance) + at));
      lanes = lesser(lanes, rows + squareOf(distance));
    }
    std::memcpy(least + at, &lanes, sizeof(lanes));
  }
}

template <typename PartT>
void extend(PartT& part, const PartT& other) {
  part = part.isEmpty() ? other
                        : PartT{std::min(part.begin, other.begin), std::max(part.end, other.end)};
}

/// Stores a part of a row. @return The part that has changed.
template <typename T, typename PartT>
PartT storeRow(T* row, const std::vector<T>& values, PartT part) {
  while (!part.isEmpty() && row[part.begin] == values[static_cast<std::size_t>(part.begin)]) {
    ++part.begin;
  }
  while (!part.isEmpty() && row[part.end - 1] == values[static_cast<std::size_t>(part.end) - 1]) {
    --part.end;
  }
  std::copy(values.begin() + part.begin, values.begin() + part.end, row + part.begin);
  return part;
}

/// Offsets of the places of a row to the nearest obstacle. @param obstacles  Where they are from the first place on,
/// ascending.
void findOffsets(const std::vector<std::int32_t>& obstacles, std::int32_t bound,
                 std::vector<std::int8_t>& offsets) {
  std::fill(offsets.begin(), offsets.end(), kNoOffset);
  const auto size = static_cast<std::int32_t>(offsets.size());
  std::int32_t begin = 0;
  for (std::size_t i = 0; i < obstacles.size(); ++i) {
    const std::int32_t at = obstacles[i];
    // The next one is nearer from the middle on.
    const std::int32_t middle =
        i + 1 < obstacles.size() ? ((at + obstacles[i + 1]) >> 1) + 1 : size;
    const std::int32_t end = std::min({middle, at + bound + 1, size});
    for (std::int32_t place = std::max(begin, at - bound); place < end; ++place) {
      offsets[static_cast<std::size_t>(place)] = static_cast<std::int8_t>(at - place);
    }
    begin = std::max(begin, middle);
  }
}

}  // namespace

/// Memory of an update, taken before it changes anything.
struct DistanceField::Scratch {
  Rows<Part> parts_of_layers;  ///< Parts of the rows of layers_ to compute.
  Rows<Part> parts;            ///< Parts of the rows of squares_ to compute.
  std::vector<BrickMask> masks;
  std::vector<std::int32_t> found;
  std::vector<std::int8_t> offsets;
  std::vector<std::int16_t> squares;

  explicit Scratch(const DistanceField& field)
      : parts_of_layers(field.layer_changes_.box, {}),
        parts(edgeOf(field.region_), {}),
        offsets(static_cast<std::size_t>(field.region_.size().x)),
        squares(static_cast<std::size_t>(field.layers_.width)) {
    const CellBox& around = field.around_;
    const std::int32_t width = brickOf(around.max).x + kBrickEdge - brickOf(around.min).x;
    masks.reserve(static_cast<std::size_t>(width / kBrickEdge));
    found.reserve(static_cast<std::size_t>(width));
  }
};

DistanceField::DistanceField(const CuboidMap& map, const CellBox& region, double bound_m,
                             UnknownPolicy policy)
    : grid_(map.grid()),
      region_(region),
      around_(checkedSurroundings(grid_, region, bound_m)),
      bound_(region.min.x - around_.min.x),
      max_square_(static_cast<std::int16_t>(std::pow(bound_m * grid_.inverseResolution(), 2.0) *
                                            (1.0 + 1e-9))),
      policy_(policy),
      offsets_({{region.min.x, around_.min.y, around_.min.z},
                {region.max.x, around_.max.y, around_.max.z}},
               kNoOffset, kLanes),
      layers_({{region.min.x, region.min.y, around_.min.z},
               {region.max.x, region.max.y, around_.max.z}},
              kFar, kLanes),
      squares_(region, kFar, kLanes),
      row_changes_(edgeOf(offsets_.box), {}),
      layer_changes_(edgeOf(layers_.box), {}) {
  ChangeSet everything;
  everything.is_everything = true;
  update(map, everything);
}

void DistanceField::update(const CuboidMap& map, const ChangeSet& changes) {
  const Obstacles obstacles(map, policy_, Budget::unlimited());
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
  Scratch scratch(*this);  // Nothing throws from here on.
  std::fill(row_changes_.values.begin(), row_changes_.values.end(), Part());
  for (const auto& [brick_z, brick_y] : rows_of_bricks) {
    computeRows(obstacles, brick_y, brick_z, scratch);
  }
  computeLayers(scratch);
  computeSquares(scratch);
}

/// The rows along x through some bricks.
void DistanceField::computeRows(const Obstacles& obstacles, std::int32_t brick_y,
                                std::int32_t brick_z, Scratch& scratch) {
  std::vector<BrickMask>& masks = scratch.masks;
  std::vector<std::int32_t>& found = scratch.found;
  std::vector<std::int8_t>& offsets = scratch.offsets;
  masks.clear();
  const std::int32_t first_x = brickOf(around_.min).x;
  for (std::int32_t x = first_x; x < around_.max.x; x += kBrickEdge) {
    masks.push_back(obstacles.inBrick({x, brick_y, brick_z}));
  }
  for (std::int32_t z = std::max(brick_z, around_.min.z);
       z < std::min(brick_z + kBrickEdge, around_.max.z); ++z) {
    for (std::int32_t y = std::max(brick_y, around_.min.y);
         y < std::min(brick_y + kBrickEdge, around_.max.y); ++y) {
      found.clear();
      for (std::size_t i = 0; i < masks.size(); ++i) {
        std::uint64_t left = masks[i][z & (kBrickEdge - 1)] >> (8 * (y & (kBrickEdge - 1))) & 0xFF;
        for (; left != 0; left &= left - 1) {
          found.push_back(first_x - region_.min.x + static_cast<std::int32_t>(kBrickEdge * i) +
                          __builtin_ctzll(left));
        }
      }
      findOffsets(found, bound_, offsets);
      *row_changes_.row(y, z) = storeRow(offsets_.row(y, z), offsets, Part{0, region_.size().x});
    }
  }
}

/// Squared distances in each layer: the least of the rows within the bound.
void DistanceField::computeLayers(Scratch& scratch) {
  Rows<Part>& parts = scratch.parts_of_layers;
  for (std::int32_t z = around_.min.z; z < around_.max.z; ++z) {
    for (std::int32_t y = around_.min.y; y < around_.max.y; ++y) {
      const Part changed = *row_changes_.row(y, z);
      if (changed.isEmpty()) continue;
      const std::int32_t end = std::min(y + bound_ + 1, region_.max.y);
      for (std::int32_t to = std::max(y - bound_, region_.min.y); to < end; ++to) {
        extend(*parts.row(to, z), changed);
      }
    }
  }
  std::vector<std::int16_t>& squares = scratch.squares;
  for (std::int32_t z = around_.min.z; z < around_.max.z; ++z) {
    for (std::int32_t y = region_.min.y; y < region_.max.y; ++y) {
      const Part part = *parts.row(y, z);
      *layer_changes_.row(y, z) = {};
      if (part.isEmpty()) continue;
      const auto row_of = [&](std::int32_t distance) { return offsets_.row(y + distance, z); };
      findLeast(part, layers_.width, bound_, row_of, squares.data());
      *layer_changes_.row(y, z) = storeRow(layers_.row(y, z), squares, part);
    }
  }
}

/// Squared distances: the least of the layers within the bound.
void DistanceField::computeSquares(Scratch& scratch) {
  Rows<Part>& parts = scratch.parts;
  for (std::int32_t z = around_.min.z; z < around_.max.z; ++z) {
    const std::int32_t end = std::min(z + bound_ + 1, region_.max.z);
    for (std::int32_t y = region_.min.y; y < region_.max.y; ++y) {
      const Part changed = *layer_changes_.row(y, z);
      if (changed.isEmpty()) continue;
      for (std::int32_t to = std::max(z - bound_, region_.min.z); to < end; ++to) {
        extend(*parts.row(y, to), changed);
      }
    }
  }
  // The rows of one y together fit into the cache.
  for (std::int32_t y = region_.min.y; y < region_.max.y; ++y) {
    for (std::int32_t z = region_.min.z; z < region_.max.z; ++z) {
      const Part part = *parts.row(y, z);
      if (part.isEmpty()) continue;
      const auto row_of = [&](std::int32_t distance) { return layers_.row(y, z + distance); };
      findLeast(part, layers_.width, bound_, row_of, squares_.row(y, z));
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
         sizeof(Part) * (row_changes_.values.capacity() + layer_changes_.values.capacity());
}

}  // namespace cuboid_mapping
