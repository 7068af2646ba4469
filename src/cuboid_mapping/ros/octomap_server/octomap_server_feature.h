// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/mapping/map_feature.h"
#include "cuboid_mapping/ros/middleware/callback_guard.h"
#include "cuboid_mapping/ros/middleware/grid_publisher.h"
#include "cuboid_mapping/ros/middleware/latched_topic.h"
#include "cuboid_mapping/ros/octomap_server/octomap_products.h"
#include "cuboid_mapping/ros/octomap_server/projected_map.h"
#include "cuboid_mapping/ros/parameters/parameters.h"

#include <ros/node_handle.h>
#include <ros/service_server.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {

/// Answers ~clear_bbx: known voxels that a box overlaps become free, with the least probability of the sensor
/// model; unknown ones stay unknown, and nothing outside the box changes.
/// @return Reason of refusal: a corner that is not finite, max below min, beyond the grid, see loadPages();
///          else empty.
[[nodiscard]] std::string clearBox(const MapInFrame& in_frame, const MetricBox& box_map);

/// A copy of a map, and its stamp.
struct MapView {
  MapSnapshot map;
  std_msgs::Header header;
};

/// A copy of the whole map, for the services octomap_binary and octomap_full: an octree cannot mark parts as
/// missing.
///
/// The part on disk is only read into the copy, and stays on disk. The map is held meanwhile.
/// @throws std::runtime_error  if parts are on disk only, and calls about them are refused, or they exceed the limits,
///         or cannot be read; or when the node ends.
[[nodiscard]] MapView viewWholeMap(const MapInFrame& map, const SnapshotLimits& limits);

/// The topics and services of octomap_server, under their names; see names.h.
///
/// With a window, topics show the part in memory; octrees of the services are whole, or the call is refused.
///
/// Nothing is built without subscribers. projected_map belongs to the publishing thread, the other topics to a
/// thread of their own: an octree of a large map takes seconds.
class OctomapServerFeature : public MapFeature {
 public:
  explicit OctomapServerFeature(const MapHost& host);
  [[nodiscard]] static std::vector<ParameterDeclaration> declare();
  [[nodiscard]] std::string name() const override { return "topics of octomap_server"; }
  void onChanges(const MapChanges& changes) override;
  void publish() override;
  void setParameters(const NodeParameters& parameters) override;
  void report(NodeReport& report) override { report.num_built = num_built_; }

 private:
  struct Topic {
    std::string name;
    std::function<void()> publish;  ///< Publishes if there are subscribers.
    bool is_due = false;
  };
  enum class Speckles : unsigned char { kKept, kAsAsked };

  template <typename MessageT>
  void advertise(const ros::NodeHandle& nh, const char* name, std::function<MessageT()> make);
  void advertiseTopics(const ros::NodeHandle& nh);
  void advertiseServices(const MapHost& host);
  /// Publishes the topics of the own thread that are due.
  void publishSlow();
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
  GuardedMap& map_;
  CallbackGuard& guard_;
  mutable std::mutex stamps_mutex_;  ///< Guards the next two.
  ros::Time last_cloud_;             ///< Stamp of the last cloud at the last change.
  ros::Time edited_;                 ///< Time of an edit since then; 0: none.
  std::atomic<std::uint64_t> num_built_{0};
  std::vector<ros::ServiceServer> servers_;
  // Of the publishing thread.
  ProjectedMap projection_;
  bool is_projection_due_ = false;
  std::optional<GridPublisher> projection_publisher_;
  // Of the own thread.
  OctomapServerParameters parameters_;
  std::array<std::optional<MapView>, 2> views_;  ///< Without and with removed speckles.
  std::vector<Topic> topics_;
  std::atomic<bool> has_changed_{false};  ///< All topics are due.
  std::atomic<bool> is_posted_{false};    ///< publishSlow() will be called.
  GuardedQueue& queue_;
};

}  // namespace cuboid_mapping_ros
