// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/MoveMap.h"
#include "cuboid_mapping/ros/diagnostics/cloud_ledger.h"
#include "cuboid_mapping/ros/map/guarded_map.h"
#include "cuboid_mapping/ros/map/map_storage.h"
#include "cuboid_mapping/ros/mapping/map_feature.h"
#include "cuboid_mapping/ros/middleware/callback_guard.h"
#include "cuboid_mapping/ros/node/cloud_mapper.h"
#include "cuboid_mapping/ros/node/cloud_receiver.h"
#include "cuboid_mapping/ros/node/node_diagnostics.h"
#include "cuboid_mapping/ros/node/node_features.h"
#include "cuboid_mapping/ros/node/publishing_thread.h"
#include "cuboid_mapping/ros/parameters/parameters.h"
#include "cuboid_mapping/ros/parameters/reconfigure.h"
#include "cuboid_mapping/ros/queries/service_call.h"

#include <ros/node_handle.h>
#include <ros/service_server.h>

#include <atomic>
#include <optional>
#include <vector>

namespace cuboid_mapping_ros {

/// The node. CloudReceiver receives clouds (messages of any source) and tf, CloudMapper puts the clouds into the map.
/// All else are features, which hang on the map: see map_feature.h. The node answers box queries, and calls that change
/// the whole map.
///
/// Names of topics and services are in names.h, parameters in parameters.h.
///
/// No exception leaves it: every callback comes from a GuardedQueue.
///
/// Thread rule: one thread receives, one maps, one publishes, one makes what takes long, and services, with changes of
/// parameters, have several. Diagnostics come from the queue of the node handles, which must have one thread (a nodelet's
/// getNodeHandle(), or a node's ros::spin()): nothing else holds them up. The threads share the map, which is guarded.
class MappingNode {
 public:
  /// @param parameters  Valid, see readParameters().
  /// @param start_map  Initial map, with the resolution of the parameters; see readStartMap().
  MappingNode(const ros::NodeHandle& nh, const ros::NodeHandle& private_nh,
              const NodeParameters& parameters,
              const std::optional<MapSnapshot>& start_map = std::nullopt);
  ~MappingNode();
  MappingNode(const MappingNode&) = delete;
  MappingNode& operator=(const MappingNode&) = delete;

 private:
  [[nodiscard]] MapHost makeHost();
  void restore(const MapSnapshot& start_map);
  void advertiseServices();
  void startDiagnostics();
  /// Sets parameters that were changed while the node runs; see reconfigure.h.
  void reconfigure(const NodeParameters& parameters);
  void onReset();
  void onMoveMap(const MoveMap::Request& request, MoveMap::Response& response);
  /// @param jump  Stamp of the first poses in the new frame; 0: now.
  [[nodiscard]] StorageAnswer moveMap(const Eigen::Isometry3d& T_new_old, const ros::Time& jump);

  // Declared first, so that they outlive the objects with callbacks.
  CallbackGuard guard_;
  std::atomic<bool> is_stopping_{false};  ///< Ends running calls.
  GuardedQueue node_callbacks_;
  ros::NodeHandle nh_;
  ros::NodeHandle private_nh_;
  GuardedThread service_threads_;  ///< Several, so that a long call does not block the others.
  GuardedThread slow_thread_;      ///< For features: see MapHost::slow_queue.
  Timer memory_timer_;
  PublishingThread publishing_;

  NodeParameters parameters_;
  GuardedMap map_;
  CloudLedger ledger_;
  CloudReceiver receiver_;
  MapInFrame map_in_frame_;
  MapHost host_;
  NodeFeatures features_;
  CloudMapper mapper_;
  NodeDiagnostics diagnostics_;
  std::vector<ros::ServiceServer> servers_;
  std::optional<ReconfigureServer> reconfigure_server_;
};

}  // namespace cuboid_mapping_ros
