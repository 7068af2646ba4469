// SPDX-License-Identifier: BSD-3-Clause
#include "indexes/cuboid_index.h"

#include "cuboid_mapping/map/cuboid_search.h"
#include "cuboid_mapping/rtree/traversal.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace cuboid_mapping::bench {
namespace {

constexpr double kFar = std::numeric_limits<double>::infinity();

/// The least of many distances.
class LeastDistances {
 public:
  explicit LeastDistances(std::size_t count) : count_(count) { least_.reserve(count + 1); }

  void add(double distance) {
    if (distance >= limit()) return;
    least_.insert(std::upper_bound(least_.begin(), least_.end(), distance), distance);
    if (least_.size() > count_) least_.pop_back();
  }
  /// Greater ones do not count.
  [[nodiscard]] double limit() const { return least_.size() < count_ ? kFar : least_.back(); }
  [[nodiscard]] std::vector<double> take() { return std::move(least_); }

 private:
  std::size_t count_;
  std::vector<double> least_;
};

/// Distance from a point inside a box to its nearest face.
double distanceToFaces(const CellBox& box, const Eigen::Vector3d& point) {
  double least = kFar;
  for (int axis = 0; axis < 3; ++axis) {
    least = std::min({least, point[axis] - box.min[axis], box.max[axis] - point[axis]});
  }
  return least;
}

}  // namespace

std::optional<Cuboid> CuboidIndex::find(const Cell& cell) const {
  std::optional<Cuboid> found;
  visitBox(CellBox::ofCell(cell), CuboidFilter::kAll, [&found](const Cuboid& cuboid) {
    found = cuboid;
    return Visit::kStop;
  });
  return found;
}

std::vector<std::unique_ptr<CuboidIndex>> makeIndexes(const CuboidMap& map) {
  std::vector<std::unique_ptr<CuboidIndex>> indexes;
  indexes.push_back(std::make_unique<TreeIndex>(map));
  indexes.push_back(std::make_unique<BrickHash>(map));
  indexes.push_back(std::make_unique<FlatList>(map));
  return indexes;
}

// ---- R-tree ------------------------------------------------------------------------------------

std::size_t TreeIndex::numBytes() const { return measureTree(map_).num_bytes; }

void TreeIndex::visitBox(const CellBox& window, CuboidFilter filter,
                         FunctionRef<Visit(const Cuboid&)> visit) const {
  cuboid_mapping::visitBox(map_, window, filter, visit);
}

std::vector<double> TreeIndex::nearest(const Eigen::Vector3d& point, std::size_t count,
                                       CuboidFilter filter) const {
  std::vector<double> distances;
  cuboid_mapping::visitNearest(map_, point, kFar, filter,
                               [&](const Cuboid& /*cuboid*/, double distance) {
                                 distances.push_back(distance);
                                 return distances.size() < count ? Visit::kContinue : Visit::kStop;
                               });
  return distances;
}

// ---- Hash of bricks ----------------------------------------------------------------------------

BrickHash::BrickHash(const CuboidMap& map) : bounds_(map.bounds()) {
  const BrickTable<Brick>& bricks = map.voxels().bricks();
  std::vector<std::uint32_t> numbers;
  bricks.forEach([&](const Brick& brick) { numbers.push_back(bricks.indexOf(brick.brick)); });
  std::sort(numbers.begin(), numbers.end());
  for (const std::uint32_t number : numbers) {
    const Brick& brick = bricks.item(number);
    Entry& entry = table_.findOrAdd(brick.brick);
    entry.has_occupied = brick.voxels.isAnyOccupied();
    entry.cuboids = &brick.cuboids;
  }
}

template <typename VisitT>
Visit BrickHash::visitEntry(const Entry& entry, CuboidFilter filter, VisitT visit) {
  if (filter == CuboidFilter::kOccupied && !entry.has_occupied) return Visit::kContinue;
  return entry.cuboids->visit(filter, [&](PackedBox box, Occupancy occupancy) {
    return visit(unpackCuboid(entry.brick, box, occupancy));
  });
}

/// All bricks in the order of their numbers, which is that of their memory, fetched ahead as the R-tree does.
template <typename VisitT>
void BrickHash::visitEntries(VisitT visit) const {
  constexpr std::size_t kAhead = 16;
  const std::size_t count = table_.size();
  const auto at = [this](std::size_t i) -> const Entry& {
    return table_.item(static_cast<std::uint32_t>(i));
  };
  for (std::size_t i = 0; i < count; ++i) {
    if (i + kAhead < count) __builtin_prefetch(at(i + kAhead).cuboids);
    if (i + kAhead / 2 < count) at(i + kAhead / 2).cuboids->prefetch();
    if (visit(at(i)) == Visit::kStop) return;
  }
}

void BrickHash::visitBox(const CellBox& window, CuboidFilter filter,
                         FunctionRef<Visit(const Cuboid&)> visit) const {
  const auto visit_entry = [&](const Entry& entry) {
    return visitEntry(entry, filter, [&](const Cuboid& cuboid) {
      return cuboid.box.intersects(window) ? visit(cuboid) : Visit::kContinue;
    });
  };
  if (numBricks(window) > static_cast<double>(table_.size())) {
    return visitEntries([&](const Entry& entry) {
      return brickBox(entry.brick).intersects(window) ? visit_entry(entry) : Visit::kContinue;
    });
  }
  (void)anyBrick(window, [&](const Cell& brick) {
    const Entry* found = table_.find(brick);
    return found != nullptr && visit_entry(*found) == Visit::kStop;
  });
}

std::vector<double> BrickHash::nearest(const Eigen::Vector3d& point, std::size_t count,
                                       CuboidFilter filter) const {
  LeastDistances least(count);
  if (!bounds_) return {};
  const auto look = [&](const Entry& entry) {
    if (distanceTo(brickBox(entry.brick), point) >= least.limit()) return;
    (void)visitEntry(entry, filter, [&](const Cuboid& cuboid) {
      least.add(distanceTo(cuboid.box, point));
      return Visit::kContinue;
    });
  };
  const auto floored = [&point](int axis) {
    return static_cast<std::int32_t>(std::floor(point[axis]));
  };
  CellBox looked_at{brickOf({floored(0), floored(1), floored(2)}), {}};
  looked_at.max = looked_at.min;  // Nothing so far.
  const Cell edge{kBrickEdge, kBrickEdge, kBrickEdge};
  CellBox next = brickBox(looked_at.min);
  while (!looked_at.contains(*bounds_)) {
    if (!looked_at.isEmpty() && distanceToFaces(looked_at, point) >= least.limit()) break;
    double num_bricks = 0.0;
    const BoxPieces shell = subtract(next, looked_at);
    for (const CellBox& piece : shell) num_bricks += numBricks(intersect(piece, *bounds_));
    if (num_bricks > static_cast<double>(table_.size())) {
      visitEntries([&](const Entry& entry) {
        if (!looked_at.contains(brickBox(entry.brick))) look(entry);
        return Visit::kContinue;
      });
      break;
    }
    for (const CellBox& piece : shell) {
      forEachBrick(intersect(piece, *bounds_), [&](const Cell& brick) {
        if (const Entry* found = table_.find(brick)) look(*found);
      });
    }
    looked_at = next;
    next = {next.min - edge, next.max + edge};
  }
  return least.take();
}

// ---- List --------------------------------------------------------------------------------------

FlatList::FlatList(const CuboidMap& map) {
  for (const CuboidFilter filter : {CuboidFilter::kOccupied, CuboidFilter::kFree}) {
    if (filter == CuboidFilter::kFree) num_occupied_ = cuboids_.size();
    visitAll(map, filter, [this](const Cuboid& cuboid) {
      cuboids_.push_back(cuboid);
      return Visit::kContinue;
    });
  }
  cuboids_.shrink_to_fit();
}

template <typename VisitT>
void FlatList::visitClass(CuboidFilter filter, VisitT visit) const {
  const std::size_t first = filter == CuboidFilter::kFree ? num_occupied_ : 0;
  const std::size_t end = filter == CuboidFilter::kOccupied ? num_occupied_ : cuboids_.size();
  for (std::size_t i = first; i < end; ++i) {
    if (visit(cuboids_[i]) == Visit::kStop) return;
  }
}

void FlatList::visitBox(const CellBox& window, CuboidFilter filter,
                        FunctionRef<Visit(const Cuboid&)> visit) const {
  visitClass(filter, [&](const Cuboid& cuboid) {
    return cuboid.box.intersects(window) ? visit(cuboid) : Visit::kContinue;
  });
}

std::vector<double> FlatList::nearest(const Eigen::Vector3d& point, std::size_t count,
                                      CuboidFilter filter) const {
  LeastDistances least(count);
  visitClass(filter, [&](const Cuboid& cuboid) {
    least.add(distanceTo(cuboid.box, point));
    return Visit::kContinue;
  });
  return least.take();
}

}  // namespace cuboid_mapping::bench
