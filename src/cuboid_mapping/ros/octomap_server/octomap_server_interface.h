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
#include <optional>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {

/// Answers ~clear_bbx: known voxels that a box overlaps become free, with the least probability of the sensor
/// model; unknown ones stay unknown, and nothing outside the box changes.
/// @return Reason of refusal: a corner that is not finite, max below min, beyond the grid, see loadPages();
///          else empty.
[[nodiscard]] std::string clearBox(GuardedMap& map, const MetricBox& box_map,
                                   const ServiceLimits& limits = {});

/// A copy of a map, and its stamp.
struct MapView {
  MapSnapshot map;
  std_msgs::Header header;
};

/// A copy of the whole map, for the services octomap_binary and octomap_full: an octree cannot mark parts as
/// missing.
///
/// The part on disk is only read into the copy, and stays on disk. The map is held meanwhile.
/// @throws std::runtime_error  if parts are on disk only, and `outside` is kRefuse, or they exceed the limits,
///         or cannot be read.
[[nodiscard]] MapView viewWholeMap(GuardedMap& map, const std::string& frame_id,
                                   QueriesOutside outside, const SnapshotLimits& limits);

/// The topics and services of octomap_server, under their names; see names.h.
///
/// With a window, topics show the part in memory; octrees of the services are whole, or the call is refused.
///
/// A topic's message is built after a change, if it has subscribers, and again after a failure; with `latch` a
/// new subscriber gets it on connection, unless the map is empty. publish() makes all messages from one copy of
/// the map's voxels, or two with filter_speckles; the map is locked for some milliseconds to copy it.
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

  /// Notes a change; call it for every change of the R-tree.
  void noteChanges(const ChangeSet& changes);

  /// Sets other parameters for the next publish().
  void setParameters(const OctomapServerParameters& parameters);

  /// Publishes changed topics that have subscribers.
  void publish();

  /// Number of messages built so far, of all topics. Thread-safe.
  [[nodiscard]] std::uint64_t numBuilt() const { return num_built_; }

 private:
  struct Topic {
    std::string name;
    std::function<void()> publish;  ///< Called if there are subscribers.
    bool is_due = false;
  };
  enum class Speckles : unsigned char { kKept, kAsAsked };

  template <typename MessageT>
  void advertise(const ros::NodeHandle& nh, const char* name, std::function<MessageT()> make);
  void advertiseTopics(const NodeParameters& parameters, const ros::NodeHandle& nh);
  void advertiseServices(const ros::NodeHandle& nh, const ros::NodeHandle& private_nh);
  void setAllDue();
  [[nodiscard]] bool hasContent() const;
  /// Stamp of a message: the last cloud's, or, as in octomap_server, the time of a later edit or of a loaded
  /// file.
  [[nodiscard]] ros::Time stampOf(const ros::Time& cloud) const;

  /// Current map, for all messages until views_ is cleared.
  [[nodiscard]] const MapView& look(Speckles speckles);
  [[nodiscard]] octomap_msgs::Octomap makeOctomap(OctreeKind kind);
  [[nodiscard]] visualization_msgs::MarkerArray makeMarkers(ShownCells cells);
  [[nodiscard]] sensor_msgs::PointCloud2 makeCenters();
  [[nodiscard]] nav_msgs::OccupancyGrid makeProjection();

  std::string frame_id_;
  bool is_latched_;
  ServiceLimits limits_;
  SnapshotLimits octree_limits_;  ///< Limits of the services' octrees.
  OctomapServerParameters parameters_;
  GuardedMap& map_;
  CallbackGuard& guard_;
  ProjectedMap projection_;
  ros::Time last_cloud_;                         ///< Stamp of the last cloud at the last change.
  ros::Time edited_;                             ///< Time of an edit since then; 0: none.
  std::array<std::optional<MapView>, 2> views_;  ///< Without and with removed speckles.
  std::atomic<std::uint64_t> num_built_{0};
  std::vector<ros::ServiceServer> servers_;
  // Last members: their callbacks end before the others are destroyed.
  std::optional<GridPublisher> projection_publisher_;
  std::vector<Topic> topics_;
};

}  // namespace cuboid_mapping_ros
