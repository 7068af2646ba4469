// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/MoveMap.h"
#include "cuboid_mapping/ros/diagnostics/cloud_ledger.h"
#include "cuboid_mapping/ros/diagnostics/diagnostics.h"
#include "cuboid_mapping/ros/diagnostics/node_statistics.h"
#include "cuboid_mapping/ros/mapping/cloud_queue.h"
#include "cuboid_mapping/ros/mapping/guarded_map.h"
#include "cuboid_mapping/ros/mapping/map_feature.h"
#include "cuboid_mapping/ros/mapping/map_storage.h"
#include "cuboid_mapping/ros/mapping/node_sources.h"
#include "cuboid_mapping/ros/mapping/phase_fair_mutex.h"
#include "cuboid_mapping/ros/mapping/sensor_input.h"
#include "cuboid_mapping/ros/mapping/service_call.h"
#include "cuboid_mapping/ros/mapping/tf_buffer.h"
#include "cuboid_mapping/ros/middleware/callback_guard.h"
#include "cuboid_mapping/ros/parameters/parameters.h"
#include "cuboid_mapping/ros/parameters/reconfigure.h"

#include <diagnostic_updater/diagnostic_updater.h>
#include <ros/node_handle.h>
#include <ros/service_server.h>
#include <ros/wall_timer.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

namespace cuboid_mapping_ros {

/// The node. It receives clouds (messages of any source) and tf, puts the clouds into the map, and answers box
/// queries. All else are features, which hang on the map: see map_feature.h.
///
/// Names of topics and services are in names.h, parameters in parameters.h.
///
/// No exception leaves it: every callback comes from a GuardedQueue.
///
/// Thread rule: one thread receives tf, and clouds for the CloudQueue; another maps them one by one. One publishes,
/// one makes what takes long, and services, with changes of parameters, have several. Diagnostics come from the
/// queue of the node handles, which must have one thread (a nodelet's getNodeHandle(), or a node's ros::spin()):
/// nothing else holds them up. The threads share the map, which is guarded, and work_mutex_.
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
  using Clock = std::chrono::steady_clock;

  [[nodiscard]] CloudQueue::Callbacks queueCallbacks();
  [[nodiscard]] CloudQueue::FindPoses makeSearch(const NodeParameters& parameters) const;
  void startDiagnostics();
  void subscribe();
  /// Puts clouds into the map until the node ends.
  void mapClouds();
  /// Waits for a cloud and puts it into the map. @return false when the node ends.
  bool mapNextCloud();
  void onCloudInTurn(const PosedCloud& cloud);
  void integrate(const PosedCloud& posed);
  /// The voxels of a cloud that enter the map: what the features leave of them.
  [[nodiscard]] const ScanUpdate& filter(const ScanUpdate& update, const CloudInWork& cloud);
  void noteReplaced();
  void restore(const MapSnapshot& start_map);
  [[nodiscard]] MapHost makeHost();
  /// Tells all features of a cloud in the map.
  void noteMapped(const MappedCloud& cloud);
  void advertiseServices();
  /// Publishes the changes of the map: it takes them once, and gives them to each feature.
  void publish();
  /// Makes the publishing thread publish a change without a cloud. Thread-safe.
  void publishSoon();
  /// Sets parameters that were changed while the node runs; see reconfigure.h.
  void reconfigure(const NodeParameters& parameters);
  void onReset();
  void onMoveMap(const MoveMap::Request& request, MoveMap::Response& response);
  /// @param jump  Stamp of the first poses in the new frame; 0: now.
  [[nodiscard]] StorageAnswer moveMap(const Eigen::Isometry3d& T_new_old, const ros::Time& jump);
  void drop(std::size_t source, DropReason reason) noexcept;
  [[nodiscard]] LastCloud describeLastCloud(const CloudLedger::Figures& figures);
  /// Logs once that nobody publishes clouds, after kMaxSilence_s.
  void warnOfSilence(const NodeReport& report);
  void reportDiagnostics(diagnostic_updater::DiagnosticStatusWrapper& status);

  // Declared first, so that they outlive the objects with callbacks.
  CallbackGuard guard_;
  std::atomic<bool> is_stopping_{false};  ///< Ends running calls.
  GuardedQueue node_callbacks_;
  GuardedThread receiving_thread_;  ///< Receives clouds and tf.
  GuardedThread service_threads_;   ///< Several, so that a long call does not block the others.
  GuardedThread publish_thread_;
  GuardedThread slow_thread_;  ///< For features: see MapHost::slow_queue.
  ros::NodeHandle nh_;
  ros::NodeHandle private_nh_;

  NodeParameters parameters_;
  CloudLedger ledger_;
  NodeSources sources_;
  FairMutex work_mutex_;  ///< Guards inputs_ and first_stamp_ns_; held while a cloud is in work.
  std::vector<std::unique_ptr<Source>> inputs_;  ///< Of the sources, with the current parameters.
  std::mutex frames_mutex_;
  std::vector<PoseFrames> frames_;  ///< Of the sources, with the current parameters. Guarded.
  /// Least stamp of a cloud; earlier ones have a frame before ~move_map.
  std::atomic<std::uint64_t> first_stamp_ns_{0};
  GuardedMap map_;
  NodeStatistics reported_statistics_;  ///< Statistics of the last report.
  bool has_warned_of_silence_ = false;
  std::uint64_t num_reported_failures_ = 0;
  MapWatch map_watch_{steadySeconds};

  diagnostic_updater::Updater diagnostics_;
  ros::WallTimer publish_timer_;
  std::atomic<bool> is_publish_due_{false};  ///< Set after an edit.
  ros::WallTimer diagnostics_timer_;

  TfBuffer tf_buffer_;
  MapInFrame map_in_frame_;
  std::vector<ros::ServiceServer> servers_;
  std::atomic<bool> is_paused_{false};
  CloudQueue clouds_;
  std::optional<ReconfigureServer> reconfigure_server_;
  std::optional<TfReceiver> tf_receiver_;
  MapHost host_;
  MapFeatures features_;
  std::vector<bool> is_behind_;  ///< Features that have missed changes. Publishing thread.
  std::thread mapping_thread_;
};

}  // namespace cuboid_mapping_ros
