// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/grid.h"
#include "cuboid_mapping/map/cuboid_search.h"
#include "cuboid_mapping/query/budget.h"
#include "cuboid_mapping/ros/conversions/marker_colors.h"

#include <std_msgs/Header.h>
#include <visualization_msgs/MarkerArray.h>

#include <array>
#include <bitset>
#include <map>
#include <set>
#include <vector>

namespace cuboid_mapping_ros {

/// Cuboids that become markers, and their appearance.
struct MarkerStyle {
  CuboidFilter filter = CuboidFilter::kOccupied;  ///< kOccupied or kFree.
  /// Heights of occupied cuboids, from blue to red; free ones all have freeColor().
  HeightRange color_span{0.0, 1.0};
};

/// The cuboids of one class as markers: one CUBE_LIST for each size of cuboid, updated by
/// changes.
///
/// A listener that applies every takeDifference(), in order, by (ns, id), has the same
/// markers as makePicture(): ADD stands for the whole list of a size, DELETE for a size of which
/// there is none any more. A cuboid longer than 8 voxels on an axis is cut at the multiples of 8 on that axis,
/// so that there are at most 512 markers: viewers become slow with many markers, not with many cubes.
///
/// Far from the origin the poses of the markers carry a multiple of 1024 m, and their points the rest.
///
/// A cuboid belongs to the page of 64 x 64 x 64 voxels of its least corner. Only changed pages are read again.
/// Not thread-safe.
class MarkerCache {
 public:
  static constexpr int kNumSizes = kBrickEdge * kBrickEdge * kBrickEdge;

  /// @param grid  Grid of the map.
  MarkerCache(const Grid& grid, const MarkerStyle& style);

  /// Notes the pages to read again. @complexity O(bricks), log in the number of pages; O(1) after release().
  void noteChanges(const ChangeSet& changes);

  /// Sets other colours; takeDifference() then has the markers that they change.
  void setColorSpan(const HeightRange& span);

  /// Whether read() has pages to read, or takeDifference() has markers.
  [[nodiscard]] bool hasChanges() const {
    return is_everything_dirty_ || !dirty_.empty() || changed_.any();
  }

  /// Reads changed pages. Between two of them the map may change: note these changes before the next call.
  /// @param budget  Without limits, but for turns of others. @complexity O(cuboids of these pages).
  void read(const CuboidMap& map, Budget& budget);

  /// Markers that read() has changed since the last call.
  /// @complexity O(cubes of these markers).
  [[nodiscard]] visualization_msgs::MarkerArray takeDifference(const std_msgs::Header& header);

  /// All markers of the last read(), for a subscriber that has none of them: DELETEALL
  /// first, for markers from an earlier run of the node, then one ADD per size.
  [[nodiscard]] visualization_msgs::MarkerArray makePicture(const std_msgs::Header& header) const;

  /// Frees the memory; the next read() reads the whole map. For times without subscribers.
  void release();

 private:
  /// A cube, by its least corner.
  struct SizedCube {
    int size_id;
    Cell min;
  };
  using CubesByPage = std::map<Cell, std::vector<Cell>>;
  using SizeSet = std::bitset<kNumSizes>;

  void readPage(const CuboidMap& map, const Cell& page);
  /// Marks all lists as changed for takeDifference().
  void markLists();
  void markEverything(const CuboidMap& map);
  void moveAnchor(const CuboidMap& map);
  void replacePage(const Cell& page, std::vector<SizedCube> cubes);
  [[nodiscard]] visualization_msgs::Marker makeMarker(int size_id,
                                                      const std_msgs::Header& header) const;

  Grid grid_;
  MarkerStyle style_;
  std::array<CubesByPage, kNumSizes> cubes_;  ///< By size; no list is empty.
  /// Sorted. cubes_ says this, too, but a changed page would have to look through all sizes there.
  std::map<Cell, std::vector<int>> sizes_in_page_;
  std::set<Cell> dirty_;  ///< Pages.
  bool is_everything_dirty_ = true;
  /// Origin of the markers' poses, see farAnchor().
  Eigen::Vector3d anchor_map_ = Eigen::Vector3d::Zero();
  SizeSet changed_;  ///< Sizes changed since the last takeDifference().
};

}  // namespace cuboid_mapping_ros
