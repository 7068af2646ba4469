// SPDX-License-Identifier: BSD-3-Clause
// The seam between the node and the features that hang on its map. features.cpp lists the features.
#pragma once

#include "cuboid_mapping/geometry/voxel_motion.h"
#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/ros/diagnostics/diagnostics.h"
#include "cuboid_mapping/ros/map/guarded_map.h"
#include "cuboid_mapping/ros/middleware/callback_guard.h"
#include "cuboid_mapping/ros/parameters/parameter_table.h"
#include "cuboid_mapping/ros/parameters/parameters.h"
#include "cuboid_mapping/ros/queries/service_call.h"
#include "cuboid_mapping/scan/scan.h"
#include "cuboid_mapping/scan/scan_update.h"

#include <diagnostic_updater/diagnostic_updater.h>
#include <ros/node_handle.h>
#include <ros/time.h>
#include <tf2/buffer_core.h>

#include <Eigen/Core>

#include <atomic>
#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {

/// A cloud, or an observation of another robot, that has entered the map.
struct MappedCloud {
  std::size_t source;  ///< Its number in the list of sources.
  ros::Time stamp;
  Eigen::Vector3d origin_map;      ///< Start of its beams.
  SensorModelConfig sensor_model;  ///< That of its source.
  const ScanUpdate& seen;          ///< Voxels of its beams.
  const ScanUpdate& mapped;        ///< Voxels that went into the map: without moving points.
};

/// A cloud on its way into the map.
struct CloudInWork {
  const std::vector<Scan>& scans;  ///< Its beams in the map's frame.
  ros::Time stamp;
  Eigen::Vector3d window_center_map;  ///< See CloudPoses.
};

/// What the node shares with its features; outlives them. The members are thread-safe.
struct MapHost {
  ros::NodeHandle nh;                  ///< For topics; callbacks come from the publishing thread.
  ros::NodeHandle private_nh;          ///< The same in the private namespace.
  ros::NodeHandle services_nh;         ///< For services, in the private namespace: several threads.
  ros::NodeHandle public_services_nh;  ///< The same in the namespace of the node.
  const NodeParameters& parameters;    ///< Those of the start; see MapFeature::setParameters().
  GuardedMap& map;
  const MapInFrame& map_in_frame;
  const tf2::BufferCore& tf;
  CallbackGuard& guard;
  GuardedQueue& slow_queue;  ///< For work of seconds, such as octrees: one thread of all features.
  const std::atomic<bool>& is_stopping;  ///< The node ends: ends long calls.
  std::function<bool()> is_paused;       ///< ~pause: nothing goes into the map.
  /// Publishes a change that no cloud has made, within publish_rate.
  std::function<void()> publish_soon;
  std::function<void()> note_replaced;  ///< Calls onReplaced() of all features, between two clouds.
  /// Counts an observation that is not one of the node's sources.
  std::function<void(const std_msgs::Header&)> note_received;
  /// Tells all features that an observation has entered the map; null: it was left out.
  std::function<void(const MappedCloud*)> note_mapped;
};

/// Changes of the map since those before.
struct MapChanges {
  const ChangeSet& changed;
  const CuboidMap& map;  ///< The map with these changes: nobody changes it meanwhile.
  ros::Time stamp;       ///< Stamp of the last cloud in it; 0: there is none.
};

/// A part of the node that hangs on its map: with topics, services, parameters and diagnostics of its own.
///
/// Each has a constructor (const MapHost&). The node calls the functions one after the other for each feature in the
/// order of the list. What exceptions do: see NodeFeatures.
class MapFeature {
 public:
  MapFeature() = default;
  virtual ~MapFeature() = default;
  MapFeature(const MapFeature&) = delete;
  MapFeature& operator=(const MapFeature&) = delete;

  // A feature hides these if it has parameters.
  /// Its parameters.
  [[nodiscard]] static std::vector<ParameterDeclaration> declare() { return {}; }
  /// Conflicts of its parameters with each other, and with those of others.
  [[nodiscard]] static std::vector<ParameterError> check(const LoadedParameters& /*loaded*/) {
    return {};
  }
  static void readReferences(NodeParameters& /*parameters*/, const FindText& /*find_text*/) {}
  /// Whether there is work for it.
  [[nodiscard]] static bool isOn(const NodeParameters& /*parameters*/) { return true; }

  /// Name in the log.
  [[nodiscard]] virtual std::string name() const = 0;

  /// Called once all features are made: before it, no function of the host may be called.
  virtual void start() {}
  /// Takes the changes of the map, at publish_rate, also when there are none. Clouds wait meanwhile, so slow work
  /// belongs to publish(). If this or publish() fails, the next changes are `is_everything`. Publishing thread.
  virtual void onChanges(const MapChanges& /*changes*/) {}
  /// Publishes, after onChanges() of all features. Publishing thread.
  virtual void publish() {}
  /// Takes the voxels of a cloud before they enter the map. @return Those that enter it, valid until the next call.
  /// Thread of the clouds.
  [[nodiscard]] virtual const ScanUpdate& filter(const ScanUpdate& update,
                                                 const CloudInWork& /*cloud*/) {
    return update;
  }
  /// The content of the map is another, by ~reset or a file: earlier clouds say nothing about it. Any thread.
  virtual void onReplaced() {}
  /// Takes a cloud that has entered the map. Thread of the clouds, or of the feature that fills the map.
  virtual void onCloud(const MappedCloud& /*cloud*/) {}
  /// Prepares a move of the whole map to another frame. @return Called once it has moved; empty: nothing to do.
  [[nodiscard]] virtual std::function<void()> prepareMove(const VoxelMotion& /*motion*/) {
    return {};
  }
  /// Sets parameters that were changed while the node runs. Publishing thread.
  virtual void setParameters(const NodeParameters& /*parameters*/) {}

  /// Adds to the node's report. Thread of the diagnostics.
  virtual void report(NodeReport& /*report*/) {}
  /// Adds a status of its own, which that thread fills. Called before start().
  virtual void addStatus(diagnostic_updater::Updater& /*diagnostics*/) {}
  /// Ends calls of others that it waits for, when the node ends.
  virtual void stop() noexcept {}
};

using MapFeatures = std::vector<std::unique_ptr<MapFeature>>;

/// The features of a node, in the order of their calls; they are destroyed in reverse.
/// @throws std::exception  if one of them cannot start, such as a window whose file is no map.
[[nodiscard]] MapFeatures makeFeatures(const MapHost& host);

}  // namespace cuboid_mapping_ros
