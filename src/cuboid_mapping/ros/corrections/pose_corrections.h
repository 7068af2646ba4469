// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/CorrectPoses.h"
#include "cuboid_mapping/ros/mapping/map_feature.h"
#include "cuboid_mapping/ros/middleware/callback_guard.h"
#include "cuboid_mapping/ros/parameters/parameters.h"

#include <nav_msgs/Path.h>
#include <ros/node_handle.h>
#include <ros/service_server.h>
#include <ros/subscriber.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {

/// A history that starts from the current map, in memory and on disk. @throws As takeWholeSnapshot().
[[nodiscard]] std::unique_ptr<KeptHistory> makeHistory(const NodeParameters& parameters,
                                                       GuardedMap& map);

/// ~correct_poses, and the topic corrected_path: rebuilds the map with corrected poses.
///
/// Thread rule: one correction after the other, in its own thread; clouds, queries and edits go on beside it.
/// Of the paths that arrive meanwhile, the last one counts.
class PoseCorrections : public MapFeature {
 public:
  /// The map keeps its history from now on.
  explicit PoseCorrections(const MapHost& host);
  ~PoseCorrections() override;
  [[nodiscard]] static std::vector<ParameterDeclaration> declare();
  [[nodiscard]] static std::vector<ParameterError> check(const LoadedParameters& loaded);
  [[nodiscard]] static bool isOn(const NodeParameters& parameters) {
    return parameters.keep.isOn();
  }
  [[nodiscard]] std::string name() const override { return "corrections"; }
  void report(NodeReport& report) override;

 private:
  void answer(const CorrectPoses::Request& request, CorrectPoses::Response& response);
  void onPath(const nav_msgs::Path& path);
  /// Checks a path, and corrects unless it moves no cloud by more than a distance. Throws nothing, but logs.
  void correct(const nav_msgs::Path& path, const CorrectionRule& rule,
               std::optional<double> ignored_shift_m, CorrectPoses::Response& response);
  void correctMap(const PoseTrack& poses, const CorrectionRule& rule,
                  CorrectPoses::Response& response);
  [[nodiscard]] PoseTrack readPath(const nav_msgs::Path& path) const;

  const MapHost& host_;
  GuardedMap& map_;
  std::string frame_id_;
  double tolerance_m_;
  bool is_without_clouds_ = false;  ///< No kept cloud was within the last path.
  GuardedThread thread_;
  ros::ServiceServer server_;
  ros::Subscriber subscriber_;
};

}  // namespace cuboid_mapping_ros
