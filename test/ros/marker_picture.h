// SPDX-License-Identifier: BSD-3-Clause
// Markers that a viewer keeps from messages, and the expected ones.
#pragma once

#include "cuboid_mapping/map/cuboid_search.h"
#include "cuboid_mapping/query/value_query.h"
#include "cuboid_mapping/ros/conversions/marker_colors.h"
#include "cuboid_mapping/ros/markers/marker_cache.h"

#include <gtest/gtest.h>
#include <visualization_msgs/MarkerArray.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <ostream>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

namespace cuboid_mapping_ros::test {

/// A cube on the screen: centre, edges, colour. Rounded, so that equal means equal to the eye.
struct ShownCube {
  std::array<long, 6> geometry_um;
  std::array<int, 4> color;

  friend bool operator==(const ShownCube& a, const ShownCube& b) {
    return a.geometry_um == b.geometry_um && a.color == b.color;
  }
  friend bool operator<(const ShownCube& a, const ShownCube& b) {
    return std::tie(a.geometry_um, a.color) < std::tie(b.geometry_um, b.color);
  }
  friend std::ostream& operator<<(std::ostream& out, const ShownCube& cube) {
    out << "centre and edges [um]";
    for (const long value : cube.geometry_um) out << ' ' << value;
    out << ", colour";
    for (const int value : cube.color) out << ' ' << value;
    return out;
  }
};

inline ShownCube makeShownCube(const Eigen::Vector3d& center_m, const Eigen::Vector3d& edges_m,
                               const std_msgs::ColorRGBA& color) {
  ShownCube cube;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<Eigen::Index>(axis);
    cube.geometry_um[axis] = std::lround(1e6 * center_m[i]);
    cube.geometry_um[axis + 3] = std::lround(1e6 * edges_m[i]);
  }
  const std::array<float, 4> channels{color.r, color.g, color.b, color.a};
  for (std::size_t i = 0; i < 4; ++i) {
    cube.color[i] = static_cast<int>(std::lround(1e4 * channels[i]));
  }
  return cube;
}

/// A viewer that keeps markers by (ns, id).
class MarkerViewer {
 public:
  using Marker = visualization_msgs::Marker;

  void apply(const visualization_msgs::MarkerArray& array) {
    for (const Marker& marker : array.markers) {
      switch (marker.action) {
        case Marker::ADD:
          checkAdded(marker);
          kept_[{marker.ns, marker.id}] = marker;
          break;
        case Marker::DELETE:
          ++num_deletes_;
          num_needless_deletes_ += kept_.erase({marker.ns, marker.id}) == 0 ? 1 : 0;
          break;
        case Marker::DELETEALL: kept_.clear(); break;
        default: FAIL() << "action " << marker.action;
      }
    }
  }

  /// All cubes on the screen, sorted.
  [[nodiscard]] std::vector<ShownCube> cubes() const {
    std::vector<ShownCube> cubes;
    for (const auto& [name, marker] : kept_) {
      for (std::size_t i = 0; i < marker.points.size(); ++i) {
        const geometry_msgs::Point& point = marker.points[i];
        cubes.push_back(makeShownCube({point.x, point.y, point.z},
                                      {marker.scale.x, marker.scale.y, marker.scale.z},
                                      marker.colors.empty() ? marker.color : marker.colors[i]));
      }
    }
    std::sort(cubes.begin(), cubes.end());
    return cubes;
  }

  [[nodiscard]] std::size_t numKept() const { return kept_.size(); }
  [[nodiscard]] std::size_t numDeletes() const { return num_deletes_; }
  /// Number of deletes of markers that it did not have.
  [[nodiscard]] std::size_t numNeedlessDeletes() const { return num_needless_deletes_; }

 private:
  static void checkAdded(const Marker& marker) {
    EXPECT_EQ(marker.type, static_cast<int>(Marker::CUBE_LIST));
    EXPECT_FALSE(marker.points.empty());
    EXPECT_TRUE(marker.colors.empty() || marker.colors.size() == marker.points.size());
    EXPECT_EQ(marker.pose.orientation.w, 1.0);
    EXPECT_GE(marker.id, 0);
    EXPECT_LT(marker.id, MarkerCache::kNumSizes);
  }

  std::map<std::pair<std::string, int>, Marker> kept_;
  std::size_t num_deletes_ = 0;
  std::size_t num_needless_deletes_ = 0;
};

/// The cubes that stand for a cuboid: cut where it is longer than 8 voxels, at the multiples of 8.
inline std::vector<cuboid_mapping::CellBox> cutIntoCubes(const cuboid_mapping::CellBox& box) {
  std::vector<cuboid_mapping::CellBox> cubes{box};
  for (int axis = 0; axis < 3; ++axis) {
    const std::int32_t length = box.max[axis] - box.min[axis];
    if (length <= 8) continue;
    std::vector<std::int32_t> cuts;
    for (std::int32_t at = box.min[axis] + 1; at < box.max[axis]; ++at) {
      if (at % 8 == 0) cuts.push_back(at);
    }
    cuts.push_back(box.max[axis]);
    std::vector<cuboid_mapping::CellBox> cut;
    for (cuboid_mapping::CellBox cube : cubes) {
      for (const std::int32_t end : cuts) {
        cube.max[axis] = end;
        cut.push_back(cube);
        cube.min[axis] = end;
      }
    }
    cubes = cut;
  }
  return cubes;
}

/// What should be on the screen for the cuboids of a map, sorted.
inline std::vector<ShownCube> expectedCubes(const cuboid_mapping::CuboidMap& map,
                                            const cuboid_mapping::Grid& grid,
                                            const MarkerStyle& style) {
  std::vector<ShownCube> cubes;
  visitAll(map, style.filter, [&](const cuboid_mapping::Cuboid& cuboid) {
    for (const cuboid_mapping::CellBox& box : cutIntoCubes(cuboid.box)) {
      const cuboid_mapping::MetricBox metric = grid.toMetricBox(box);
      const Eigen::Vector3d center_m = 0.5 * (metric.min_m + metric.max_m);
      std_msgs::ColorRGBA color = freeColor();
      if (style.filter == cuboid_mapping::CuboidFilter::kOccupied) {
        color = toSpanColor(center_m.z(), style.color_span);
      }
      cubes.push_back(makeShownCube(center_m, metric.max_m - metric.min_m, color));
    }
    return cuboid_mapping::Visit::kContinue;
  });
  std::sort(cubes.begin(), cubes.end());
  return cubes;
}

/// Cubes without colours: those of a node fit its map at some time.
inline std::vector<ShownCube> withoutColors(std::vector<ShownCube> cubes) {
  for (ShownCube& cube : cubes) cube.color = {};
  return cubes;
}

}  // namespace cuboid_mapping_ros::test
