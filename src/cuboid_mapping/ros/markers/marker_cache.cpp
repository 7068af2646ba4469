// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/markers/marker_cache.h"

#include "cuboid_mapping/geometry/page.h"
#include "cuboid_mapping/ros/conversions/points.h"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <utility>

namespace cuboid_mapping_ros {
namespace {

using visualization_msgs::Marker;
using visualization_msgs::MarkerArray;

constexpr std::int32_t kEdge = kBrickEdge;

int toSizeId(const Cell& size) { return size.x - 1 + kEdge * (size.y - 1 + kEdge * (size.z - 1)); }

Cell toSize(int size_id) {
  return {size_id % kEdge + 1, size_id / kEdge % kEdge + 1, size_id / (kEdge * kEdge) + 1};
}

/// End of the first piece of [begin, end).
std::int32_t endOfPiece(std::int32_t begin, std::int32_t end) {
  return end - begin <= kEdge ? end : (begin & ~(kEdge - 1)) + kEdge;
}

/// Calls visit(least corner, size) for the pieces of a box.
template <typename VisitT>
void visitPieces(const CellBox& box, const VisitT& visit) {
  Cell min;
  Cell max;
  for (min.z = box.min.z; min.z < box.max.z; min.z = max.z) {
    max.z = endOfPiece(min.z, box.max.z);
    for (min.y = box.min.y; min.y < box.max.y; min.y = max.y) {
      max.y = endOfPiece(min.y, box.max.y);
      for (min.x = box.min.x; min.x < box.max.x; min.x = max.x) {
        max.x = endOfPiece(min.x, box.max.x);
        visit(min, max - min);
      }
    }
  }
}

}  // namespace

MarkerCache::MarkerCache(const Grid& grid, const MarkerStyle& style) : grid_(grid), style_(style) {}

void MarkerCache::noteChanges(const ChangeSet& changes) {
  if (is_everything_dirty_) return;
  if (changes.is_everything) {
    is_everything_dirty_ = true;
    dirty_.clear();
    return;
  }
  for (const ChangedBrick& changed : changes.bricks) {
    if (changed.has_new_cuboids) dirty_.insert(pageOf(changed.brick));
  }
}

void MarkerCache::read(const CuboidMap& map, Budget& budget) {
  if (is_everything_dirty_) markEverything(map);
  is_everything_dirty_ = false;
  moveAnchor(map);
  while (!dirty_.empty() && budget.checkClock()) {
    readPage(map, *dirty_.begin());
    dirty_.erase(dirty_.begin());
  }
}

void MarkerCache::markLists() {
  for (std::size_t size_id = 0; size_id < cubes_.size(); ++size_id) {
    if (!cubes_[size_id].empty()) changed_.set(size_id);
  }
}

void MarkerCache::setColorSpan(const HeightRange& span) {
  style_.color_span = span;
  markLists();
}

MarkerArray MarkerCache::takeDifference(const std_msgs::Header& header) {
  MarkerArray array;
  array.markers.reserve(changed_.count());
  for (int size_id = 0; size_id < kNumSizes; ++size_id) {
    if (changed_[static_cast<std::size_t>(size_id)]) {
      array.markers.push_back(makeMarker(size_id, header));
    }
  }
  changed_.reset();
  return array;
}

MarkerArray MarkerCache::makePicture(const std_msgs::Header& header) const {
  MarkerArray array;
  Marker delete_all;
  delete_all.header = header;
  delete_all.action = Marker::DELETEALL;
  delete_all.pose.orientation.w = 1.0;
  array.markers.push_back(delete_all);
  for (int size_id = 0; size_id < kNumSizes; ++size_id) {
    if (!cubes_[static_cast<std::size_t>(size_id)].empty()) {
      array.markers.push_back(makeMarker(size_id, header));
    }
  }
  return array;
}

void MarkerCache::release() { *this = MarkerCache(grid_, style_); }

void MarkerCache::readPage(const CuboidMap& map, const Cell& page) {
  const CellBox box = pageBox(page);
  std::vector<SizedCube> cubes;
  const auto add = [&](const Cuboid& cuboid) {
    if (!box.contains(cuboid.box.min)) return Visit::kContinue;
    visitPieces(cuboid.box, [&](const Cell& min, const Cell& size) {
      cubes.push_back({toSizeId(size), min});
    });
    return Visit::kContinue;
  };
  visitBox(map, box, style_.filter, add);
  replacePage(page, std::move(cubes));
}

/// Follows the map, which may be empty at the first reading, and grow far.
void MarkerCache::moveAnchor(const CuboidMap& map) {
  const auto bounds = map.bounds();
  if (!bounds) return;
  const Eigen::Vector3d anchor_map = farAnchor(grid_.centerOf(*bounds));
  if (anchor_map == anchor_map_) return;
  anchor_map_ = anchor_map;
  markLists();
}

/// Marks all pages that have, or had, cubes.
void MarkerCache::markEverything(const CuboidMap& map) {
  for (const auto& [page, sizes] : sizes_in_page_) dirty_.insert(page);
  map.voxels().forEach([this](const VoxelBrick& brick) { dirty_.insert(pageOf(brick.brick)); });
}

void MarkerCache::replacePage(const Cell& page, std::vector<SizedCube> cubes) {
  // The order depends on the cubes only, so unchanged markers compare equal.
  std::sort(cubes.begin(), cubes.end(), [](const SizedCube& a, const SizedCube& b) {
    return a.size_id != b.size_id ? a.size_id < b.size_id : a.min < b.min;
  });
  std::vector<int> sizes;
  for (auto first = cubes.cbegin(); first != cubes.cend();) {
    const int size_id = first->size_id;
    std::vector<Cell> list;
    for (; first != cubes.cend() && first->size_id == size_id; ++first) list.push_back(first->min);
    sizes.push_back(size_id);
    std::vector<Cell>& known_cubes = cubes_[static_cast<std::size_t>(size_id)][page];
    if (known_cubes == list) continue;
    known_cubes = std::move(list);
    changed_.set(static_cast<std::size_t>(size_id));
  }

  std::vector<int>& known_sizes = sizes_in_page_[page];
  std::vector<int> vanished;
  std::set_difference(known_sizes.begin(), known_sizes.end(), sizes.begin(), sizes.end(),
                      std::back_inserter(vanished));
  for (const int size_id : vanished) {
    cubes_[static_cast<std::size_t>(size_id)].erase(page);
    changed_.set(static_cast<std::size_t>(size_id));
  }
  known_sizes = std::move(sizes);
  if (known_sizes.empty()) sizes_in_page_.erase(page);
}

Marker MarkerCache::makeMarker(int size_id, const std_msgs::Header& header) const {
  const CubesByPage& pages = cubes_[static_cast<std::size_t>(size_id)];
  const Cell size = toSize(size_id);
  const Eigen::Vector3d size_m = grid_.resolution() * Eigen::Vector3d(size.x, size.y, size.z);
  const bool has_colors = style_.filter == CuboidFilter::kOccupied;
  Marker marker = makeCubeList(header, has_colors ? "occupied" : "free", size_id, size_m);
  marker.action = pages.empty() ? Marker::DELETE : Marker::ADD;
  marker.pose.position = toPoint(anchor_map_);
  marker.color = freeColor();

  std::size_t num_cubes = 0;
  for (const auto& [page, cubes] : pages) num_cubes += cubes.size();
  marker.points.reserve(num_cubes);
  if (has_colors) marker.colors.reserve(num_cubes);
  for (const auto& [page, cubes] : pages) {
    for (const Cell& min : cubes) {
      const Eigen::Vector3d center = grid_.centerOf({min, min + size});
      marker.points.push_back(toPoint(center - anchor_map_));
      if (has_colors) marker.colors.push_back(toSpanColor(center.z(), style_.color_span));
    }
  }
  return marker;
}

}  // namespace cuboid_mapping_ros
