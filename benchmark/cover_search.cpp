// SPDX-License-Identifier: BSD-3-Clause
#include "cover_search.h"

#include "cuboid_mapping/boxes/joined_cuboids.h"
#include "cuboid_mapping/query/voxel_set.h"

#include <chrono>
#include <cmath>
#include <optional>
#include <random>
#include <set>

namespace cuboid_mapping::bench {
namespace {

using Cells = std::vector<Cell>;

Cells occupiedCells(const CuboidMap& map) {
  Cells cells;
  map.voxels().forEach([&](const VoxelBrick& brick) {
    forEachCell(brick.brick, brick.voxels.occupied(),
                [&](const Cell& cell) { cells.push_back(cell); });
  });
  return cells;
}

std::optional<CellBox> boundsOf(const Cells& cells) {
  std::optional<CellBox> bounds;
  for (const Cell& cell : cells) {
    bounds = bounds ? unite(*bounds, CellBox::ofCell(cell)) : CellBox::ofCell(cell);
  }
  return bounds;
}

int longestAxis(const CellBox& box) {
  const Cell size = box.size();
  return size.x >= size.y && size.x >= size.z ? 0 : (size.y >= size.z ? 1 : 2);
}

class Annealing {
 public:
  Annealing(const CuboidMap& map, std::vector<CellBox> boxes, unsigned seed)
      : occupied_(Budget::unlimited()), boxes_(std::move(boxes)), random_(seed) {
    for (const Cell& cell : occupiedCells(map)) occupied_.add(CellBox::ofCell(cell));
    num_added_ = count(boxes_);
    best_ = boxes_;
    num_best_ = num_added_;
  }

  /// @param heat  Added voxels that a step may cost, as a share of all.
  void step(double heat) {
    std::vector<CellBox> boxes = boxes_;
    const bool is_changed = index(4) == 0 ? shrinkOne(boxes) : splitOne(boxes) && uniteTwo(boxes);
    if (!is_changed) return;
    const double num_added = count(boxes);
    const double limit = num_added_ - heat * num_added_ * std::log(1.0 - share_(random_));
    if (num_added > limit) return;
    boxes_ = std::move(boxes);
    num_added_ = num_added;
    if (num_added_ >= num_best_) return;
    best_ = boxes_;
    num_best_ = num_added_;
  }

  void restart() {
    boxes_ = best_;
    num_added_ = num_best_;
  }
  [[nodiscard]] const std::vector<CellBox>& best() const { return best_; }

 private:
  std::size_t index(std::size_t size) { return static_cast<std::size_t>(random_() % size); }

  double count(const std::vector<CellBox>& boxes) const {
    VoxelSet covered(Budget::unlimited());
    for (const CellBox& box : boxes) covered.add(box);
    return covered.size() - occupied_.size();
  }

  /// Bounds of the occupied voxels of a box that none of the others holds.
  std::optional<CellBox> ownBounds(const CellBox& box, const std::vector<CellBox>& others) const {
    std::optional<CellBox> bounds;
    occupied_.forEachBrickIn(box, [&](const Cell& brick, BrickMask voxels) {
      for (const CellBox& other : others) {
        const CellBox part = intersect(other, brickBox(brick));
        if (!part.isEmpty()) voxels = voxels.without(BrickMask::ofBox(part));
      }
      forEachCell(brick, voxels, [&](const Cell& cell) {
        bounds = bounds ? unite(*bounds, CellBox::ofCell(cell)) : CellBox::ofCell(cell);
      });
    });
    return bounds;
  }

  bool shrinkOne(std::vector<CellBox>& boxes) {
    const std::size_t i = index(boxes.size());
    const CellBox box = boxes[i];
    boxes.erase(boxes.begin() + static_cast<std::ptrdiff_t>(i));
    const auto own = ownBounds(box, boxes);
    if (own) boxes.push_back(*own);
    return !own || *own != box;
  }

  bool splitOne(std::vector<CellBox>& boxes) {
    const std::size_t i = index(boxes.size());
    const int axis = static_cast<int>(index(3));
    CellBox lower = boxes[i];
    CellBox upper = boxes[i];
    if (lower.size()[axis] < 2) return false;
    lower.max[axis] =
        lower.min[axis] + 1 +
        static_cast<std::int32_t>(index(static_cast<std::size_t>(lower.size()[axis] - 1)));
    upper.min[axis] = lower.max[axis];
    boxes.erase(boxes.begin() + static_cast<std::ptrdiff_t>(i));
    for (const CellBox& part : {lower, upper}) {
      if (const auto own = ownBounds(part, boxes)) boxes.push_back(*own);
    }
    return true;
  }

  /// Unites a random box with the one that adds least, the second or the third; or leaves all as they are.
  bool uniteTwo(std::vector<CellBox>& boxes) {
    if (boxes.size() <= best_.size()) return true;
    const std::size_t i = index(boxes.size());
    std::set<std::pair<double, std::size_t>> partners;
    for (std::size_t k = 0; k < boxes.size(); ++k) {
      if (k == i) continue;
      partners.emplace(unite(boxes[i], boxes[k]).numVoxels() - boxes[i].numVoxels() -
                           boxes[k].numVoxels() + intersect(boxes[i], boxes[k]).numVoxels(),
                       k);
    }
    const auto partner =
        std::next(partners.begin(),
                  static_cast<std::ptrdiff_t>(index(std::min<std::size_t>(3, partners.size()))));
    boxes[i] = unite(boxes[i], boxes[partner->second]);
    boxes.erase(boxes.begin() + static_cast<std::ptrdiff_t>(partner->second));
    return true;
  }

  VoxelSet occupied_;
  std::vector<CellBox> boxes_;
  std::vector<CellBox> best_;
  double num_added_ = 0.0;
  double num_best_ = 0.0;
  std::mt19937 random_;
  std::uniform_real_distribution<double> share_{0.0, 1.0};
};

}  // namespace

std::vector<CellBox> coverByOctree(const CuboidMap& map, std::size_t max_boxes) {
  const Cells cells = occupiedCells(map);
  for (int level = 0; level < 30; ++level) {
    std::set<Cell> cubes;
    for (const Cell& cell : cells) {
      const std::int32_t mask = ~((1 << level) - 1);
      cubes.insert({cell.x & mask, cell.y & mask, cell.z & mask});
      if (cubes.size() > max_boxes) break;
    }
    if (cubes.size() > max_boxes) continue;
    std::vector<CellBox> boxes;
    boxes.reserve(cubes.size());
    const std::int32_t edge = 1 << level;
    for (const Cell& cube : cubes) boxes.push_back({cube, cube + Cell{edge, edge, edge}});
    return boxes;
  }
  return {};
}

std::vector<CellBox> coverByBisection(const CuboidMap& map, std::size_t max_boxes) {
  struct Part {
    Cells cells;
    CellBox box;
  };
  const auto is_smaller = [](const Part& a, const Part& b) {
    const auto rank = [](const Part& part) {
      return part.box.numVoxels() - static_cast<double>(part.cells.size());
    };
    return rank(a) < rank(b);
  };
  std::vector<Part> parts;
  Cells all = occupiedCells(map);
  if (all.empty()) return {};
  const CellBox whole = *boundsOf(all);
  parts.push_back({std::move(all), whole});
  while (parts.size() < max_boxes) {
    std::pop_heap(parts.begin(), parts.end(), is_smaller);
    Part part = std::move(parts.back());
    parts.pop_back();
    const int axis = longestAxis(part.box);
    const std::int32_t middle = part.box.min[axis] + part.box.size()[axis] / 2;
    Cells halves[2];
    for (const Cell& cell : part.cells) halves[cell[axis] < middle ? 0 : 1].push_back(cell);
    if (halves[0].empty() || halves[1].empty()) break;
    for (Cells& half : halves) {
      const CellBox box = *boundsOf(half);
      parts.push_back({std::move(half), box});
      std::push_heap(parts.begin(), parts.end(), is_smaller);
    }
  }
  std::vector<CellBox> boxes;
  boxes.reserve(parts.size());
  for (const Part& part : parts) boxes.push_back(part.box);
  return boxes;
}

std::vector<CellBox> searchCover(const CuboidMap& map, std::vector<CellBox> boxes, double time_s,
                                 unsigned seed) {
  Annealing annealing(map, std::move(boxes), seed);
  const auto begin = std::chrono::steady_clock::now();
  for (std::size_t i = 0;; ++i) {
    const std::chrono::duration<double> passed = std::chrono::steady_clock::now() - begin;
    if (passed.count() > time_s) break;
    const double left = 1.0 - passed.count() / time_s;
    annealing.step(0.003 * left * left);
    if (i % 2000 == 1999) annealing.restart();
  }
  return annealing.best();
}

double countAdded(const CuboidMap& map, const std::vector<CellBox>& boxes) {
  VoxelSet covered(Budget::unlimited());
  for (const CellBox& box : boxes) covered.add(box);
  return covered.size() - map.voxels().numOccupiedVoxels();
}

}  // namespace cuboid_mapping::bench
