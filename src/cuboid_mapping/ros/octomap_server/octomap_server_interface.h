// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/map/guarded_map.h"
#include "cuboid_mapping/ros/middleware/callback_guard.h"
#include "cuboid_mapping/ros/octomap_server/grid_publisher.h"
#include "cuboid_mapping/ros/octomap_server/octomap_products.h"
#include "cuboid_mapping/ros/octomap_server/projected_map.h"
#include "cuboid_mapping/ros/parameters/parameters.h"
#include "cuboid_mapping/ros/publishers/latched_topic.h"

#include <ros/node_handle.h>
#include <ros/service_server.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {

/// Sets the known voxels that a box overlaps to free, with the least probability of the sensor
/// model; unknown ones stay unknown, and nothing outside the box changes: ~clear_bbx.
/// @return Why it cannot: a corner that is not finite, max below min, beyond the grid, see loadPages(); else empty.
[[nodiscard]] std::string clearBox(GuardedMap& map, const cuboid_mapping::MetricBox& box_map,
                                   const ServiceLimits& limits = {});

/// A copy of a map, and its stamp.
struct MapView {
  cuboid_mapping::MapSnapshot map;
  std_msgs::Header header;
};

/// The whole map, for octomap_binary and octomap_full as services: an octree has no word for "elsewhere".
///
/// The part on disk only is read into the copy, and stays on disk. The map is held meanwhile.
/// @throws std::runtime_error  where parts are on disk only, and `outside` is kRefuse, or they are more than the limits,
///         or cannot be read.
[[nodiscard]] MapView viewWholeMap(GuardedMap& map, const std::string& frame_id,
                                   QueriesOutside outside,
                                   const cuboid_mapping::SnapshotLimits& limits);

/// The topics and services of octomap_server, under their names; see names.h.
///
/// With a window, topics show the part in memory; octrees of the services are whole, or refused.
///
/// A topic is built only while somebody listens to it, after a change, and again while it fails; with `latch` a new
/// listener gets it as soon as it connects, unless the map is empty. What publish() sends is made of one copy of the map's voxels, or of two with
/// filter_speckles, taken while the map is held for some milliseconds.
///
/// Thread rule: noteChanges(), publish() and the topics' callbacks belong to one queue; the
/// services have a queue of their own.
class OctomapServerInterface {
 public:
  /// Queues for callbacks.
  struct Queues {
    GuardedQueue& topics;
    GuardedQueue& services;
  };

  /// @param map  Must outlive this object.
  OctomapServerInterface(const ros::NodeHandle& nh, const ros::NodeHandle& private_nh,
                         const NodeParameters& parameters, GuardedMap& map, Queues queues);
  OctomapServerInterface(const OctomapServerInterface&) = delete;
  OctomapServerInterface& operator=(const OctomapServerInterface&) = delete;

  /// To be called with every change of the R-tree.
  void noteChanges(const cuboid_mapping::ChangeSet& changes);

  /// Takes other parameters, from the next publish() on. Thread-safe.
  void setParameters(const OctomapServerParameters& parameters);

  /// Publishes what has changed and is listened to.
  void publish();

  /// Messages of all topics that have been built so far. Thread-safe.
  [[nodiscard]] std::uint64_t numBuilt() const { return num_built_; }

 private:
  struct Topic {
    std::string name;
    std::function<void()> publish;  ///< Called if somebody listens.
    bool is_due = false;
  };
  enum class Speckles : unsigned char { kKept, kAsAsked };

  template <typename MessageT>
  void advertise(const ros::NodeHandle& nh, const char* name, std::function<MessageT()> make);
  void advertiseTopics(const NodeParameters& parameters, const ros::NodeHandle& nh);
  void advertiseServices(ros::NodeHandle nh, ros::NodeHandle private_nh);
  void takePendingParameters();
  void setAllDue();
  [[nodiscard]] bool hasContent() const;
  /// Stamp of a message: the last cloud's, or, as in octomap_server, the time of a later edit or of a loaded file.
  [[nodiscard]] ros::Time stampOf(const ros::Time& cloud) const;

  /// The map now, for what is made until views_ is cleared.
  [[nodiscard]] const MapView& look(Speckles speckles);
  [[nodiscard]] OctomapMessage makeOctomap(cuboid_mapping::OctreeKind kind);
  [[nodiscard]] visualization_msgs::MarkerArray makeMarkers(ShownCells cells);
  [[nodiscard]] sensor_msgs::PointCloud2 makeCenters();
  [[nodiscard]] nav_msgs::OccupancyGrid makeProjection();

  std::string frame_id_;
  bool is_latched_;
  ServiceLimits limits_;
  cuboid_mapping::SnapshotLimits octree_limits_;  ///< Limits of the services' octrees.
  OctomapServerParameters parameters_;
  GuardedMap& map_;
  CallbackGuard& guard_;
  ProjectedMap projection_;
  ros::Time last_cloud_;                         ///< In the map, at the last change.
  ros::Time edited_;                             ///< Since then; 0: not.
  std::array<std::optional<MapView>, 2> views_;  ///< Without and with removed speckles.
  std::atomic<std::uint64_t> num_built_{0};
  std::mutex pending_mutex_;
  std::optional<OctomapServerParameters> pending_;  ///< To be taken by publish().
  ros::ServiceServer binary_server_;
  ros::ServiceServer full_server_;
  ros::ServiceServer clear_server_;
  // Last: their callbacks end before the rest goes.
  std::optional<GridPublisher> projection_publisher_;
  std::vector<Topic> topics_;
};

}  // namespace cuboid_mapping_ros
