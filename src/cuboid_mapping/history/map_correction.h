// SPDX-License-Identifier: BSD-3-Clause
// A corrected map that is being built.
#pragma once

#include "cuboid_mapping/history/cloud_replay.h"
#include "cuboid_mapping/history/map_history.h"

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace cuboid_mapping {

/// A cloud, or an edit of the map.
struct HistoryEvent {
  std::shared_ptr<const ObservationConfig> config;  ///< Null for an edit.
  StampedPose pose;
  std::size_t num_bytes = 0;
  std::size_t num_points = 0;
  // Members of an edit:
  CellBox box{};
  CellBox whole{};  ///< Box of the whole edit, whose parts move as one.
  std::vector<VoxelBrick> bricks;
  std::vector<CellBox> locked;  ///< Locks after the edit.
  /// Boxes that the edit has locked and unlocked.
  ///@{
  std::vector<CellBox> newly_locked;
  std::vector<CellBox> newly_unlocked;
  ///@}

  [[nodiscard]] bool isCloud() const { return config != nullptr; }
};

/// Upper bound of the motion of a point at this distance from a body.
[[nodiscard]] double findShift_m(const Eigen::Isometry3d& T_map_old,
                                 const Eigen::Isometry3d& T_map_new, double distance_m);

/// Pose of a body at a stamp that the new poses cover. @param gap_motions  See MapCorrection::Implementation.
[[nodiscard]] Eigen::Isometry3d correctedPose(const PoseTrack& poses,
                                              const std::optional<PoseTrack>& gap_motions,
                                              const StampedPose& old);

struct MapCorrection::Implementation {
  Implementation(PoseTrack new_poses, const CorrectionRule& correction_rule, CuboidMap base)
      : track(std::move(new_poses)), rule(correction_rule), map(std::move(base)) {}

  [[nodiscard]] Eigen::Isometry3d newPose(const StampedPose& old) const;
  [[nodiscard]] bool moves(const HistoryEvent& cloud) const {
    return newPose(cloud.pose).matrix() != cloud.pose.T_map_body.matrix();
  }

  /// Motion of the body at a cloud; exactly the identity if it stays.
  [[nodiscard]] Eigen::Isometry3d motionOf(const HistoryEvent& cloud) const;
  /// Shift of an edit, in voxels, after a cloud with this motion.
  [[nodiscard]] Cell shiftOf(const HistoryEvent& edit, const Eigen::Isometry3d& motion) const;

  /// Applies the next event. @param packed  Empty for an edit.
  void put(const HistoryEvent& event, const std::string& packed, double step_m,
           CloudReplay& replay);

  PoseTrack track;
  CorrectionRule rule;
  CuboidMap map;
  /// Motion of the clouds before the new poses, and after them.
  ///@{
  Eigen::Isometry3d T_new_first = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d T_new_last = Eigen::Isometry3d::Identity();
  ///@}
  /// Motions at the ends of the gaps of the track: between them, the motion is interpolated, not the pose.
  std::optional<PoseTrack> gap_motions;
  Eigen::Isometry3d motion =
      Eigen::Isometry3d::Identity();  ///< Motion of the last cloud; at first, of the first cloud.
  std::map<std::size_t, HistoryEvent> moved_edits;  ///< Edits by their index among the events.
  std::vector<Eigen::Isometry3d> poses;             ///< New poses of the events so far.
  std::size_t num_clouds = 0;
  std::size_t num_outside = 0;
  double max_shift_m = 0.0;
  std::uint64_t start = 0;     ///< Number of the restart() that it belongs to.
  std::shared_ptr<void> hold;  ///< Keeps events while it lives.

 private:
  void putEdit(const HistoryEvent& edit);
  void putMovedEdit(const HistoryEvent& edit);
};

}  // namespace cuboid_mapping
