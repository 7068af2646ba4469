// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/grid.h"
#include "cuboid_mapping/occupancy/sensor_model.h"
#include "cuboid_mapping/ros/parameters/service_limits.h"

#include <ros/time.h>
#include <tf2/buffer_core.h>

#include <atomic>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

namespace cuboid_mapping {
class CuboidMap;
}

namespace cuboid_mapping_ros {

class GuardedMap;

/// Which cuboids an answer holds, with the values of cuboid_mapping/QueryBox.
enum class WantedCuboids : std::uint8_t { kNone = 0, kFree = 1, kOccupied = 2, kAll = 3 };

/// What is asked of ~query_box; its contract is in srv/QueryBox.srv.
struct BoxRequest {
  std::string frame_id;             ///< Empty: that of the map.
  ros::Time stamp;                  ///< 0: the latest transform.
  cuboid_mapping::MetricBox box;    ///< Metres, in frame_id.
  std::uint8_t wanted_cuboids = 0;  ///< A WantedCuboids, not yet checked.
  bool is_clipped = false;          ///< Whether the cuboids are cut at the faces of the box.
};

/// A cuboid of an answer, in metres, map frame.
struct AnswerCuboid {
  cuboid_mapping::MetricBox box_map;    ///< Cut at the faces of the box if that was asked for.
  cuboid_mapping::Occupancy occupancy;  ///< kFree or kOccupied.
  double probability;                   ///< Mean of its voxels.
};

/// What ~query_box answers.
struct BoxAnswer {
  std::string error;           ///< Why there is no answer, and what to do; empty: there is one.
  std::uint64_t revision = 0;  ///< Of the map that was looked at.
  ros::Time stamp;             ///< Of the last cloud in the map; 0 when there is none.
  cuboid_mapping::MetricBox box_map;  ///< The voxels that the figures are for.
  double free_volume_m3 = 0.0;        ///< Of the free voxels in box_map.
  double occupied_volume_m3 = 0.0;    ///< Of the occupied ones.
  double unknown_volume_m3 = 0.0;     ///< Of all others.
  /// Occupied if any voxel is; else unknown if any is; else free.
  cuboid_mapping::Occupancy occupancy = cuboid_mapping::Occupancy::kUnknown;
  /// Of all known voxels; NaN when there are none.
  double max_probability = std::numeric_limits<double>::quiet_NaN();
  std::vector<AnswerCuboid> cuboids;  ///< Those that were wanted, in no particular order.
  std::string cut;  ///< Not empty: which limit has cut the answer short, and what to do.
};

/// A map and how its frame gets its name.
struct MapInFrame {
  GuardedMap& map;                                ///< The map and its lock.
  std::string frame_id;                           ///< Of the map.
  const tf2::BufferCore& tf;                      ///< For requests in other frames.
  ServiceLimits limits = {};                      ///< Of each call.
  const std::atomic<bool>* is_stopped = nullptr;  ///< true ends the work on all calls.
};

/// Looks up the box in the map as the last cloud has left it. Waits for changes of the map that are
/// under way, never for tf; never throws.
///
/// Cases without an answer:
///   - wanted_cuboids is none of WantedCuboids;
///   - a coordinate is NaN or infinite, or min >= max on some axis;
///   - tf has no transform from the request's frame to the map's at the request's stamp;
///   - the box reaches beyond the cells that a map can have.
/// With more in the box than the limits allow, voxels that were not looked at count as unknown, cuboids are
/// missing, and `cut` says so.
/// @complexity As cuboid_mapping::queryBox().
[[nodiscard]] BoxAnswer answerBoxRequest(const MapInFrame& map, const BoxRequest& request);

}  // namespace cuboid_mapping_ros
