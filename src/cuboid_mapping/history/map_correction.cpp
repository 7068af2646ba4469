// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/history/map_correction.h"

#include "cuboid_mapping/history/kept_clouds.h"
#include "cuboid_mapping/map/map_merge.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace cuboid_mapping {
namespace {

CellBox translated(const CellBox& box, const Cell& shift) {
  return box.isEmpty() ? box : intersect({box.min + shift, box.max + shift}, kAllCells);
}

void translate(const Cell& shift, std::vector<CellBox>& boxes) {
  for (CellBox& box : boxes) box = translated(box, shift);
}

HistoryEvent translated(HistoryEvent edit, const Cell& shift, double resolution_m) {
  if (shift == Cell{0, 0, 0}) return edit;
  edit.box = translated(edit.box, shift);
  edit.whole = translated(edit.whole, shift);
  translate(shift, edit.newly_locked);
  translate(shift, edit.newly_unlocked);
  MapSnapshot content;
  content.resolution_m = resolution_m;
  content.bricks = std::move(edit.bricks);
  sortBricks(content.bricks);
  const Eigen::Vector3d shift_m = resolution_m * Eigen::Vector3d(shift.x, shift.y, shift.z);
  (void)moveMap(Eigen::Isometry3d(Eigen::Translation3d(shift_m)), content);
  edit.bricks = std::move(content.bricks);
  return edit;
}

}  // namespace

double findShift_m(const Eigen::Isometry3d& T_map_old, const Eigen::Isometry3d& T_map_new,
                   double distance_m) {
  const Eigen::AngleAxisd turn(
      Eigen::Matrix3d(T_map_new.linear() * T_map_old.linear().transpose()));
  return (T_map_new.translation() - T_map_old.translation()).norm() +
         2.0 * distance_m * std::sin(0.5 * std::abs(turn.angle()));
}

Eigen::Isometry3d correctedPose(const PoseTrack& poses, const std::optional<PoseTrack>& gap_motions,
                                const StampedPose& old) {
  return poses.findGap(old.stamp_ns) ? gap_motions->at(old.stamp_ns) * old.T_map_body
                                     : poses.at(old.stamp_ns);
}

MapCorrection::MapCorrection(std::unique_ptr<Implementation> implementation)
    : implementation_(std::move(implementation)) {}
MapCorrection::MapCorrection(MapCorrection&&) noexcept = default;
MapCorrection::~MapCorrection() = default;
CuboidMap& MapCorrection::map() { return implementation_->map; }
std::size_t MapCorrection::numClouds() const { return implementation_->num_clouds; }
std::size_t MapCorrection::numOutside() const { return implementation_->num_outside; }
double MapCorrection::maxShift_m() const { return implementation_->max_shift_m; }

Eigen::Isometry3d MapCorrection::Implementation::newPose(const StampedPose& old) const {
  const bool is_inside = track.covers(old.stamp_ns);
  if (!is_inside && rule.outside == OutsidePoses::kStay) return old.T_map_body;
  const Eigen::Isometry3d T_map_new =
      is_inside ? correctedPose(track, gap_motions, old)
                : (old.stamp_ns < track.begin_ns() ? T_new_first : T_new_last) * old.T_map_body;
  const bool is_tolerated =
      rule.tolerance_m > 0.0 &&
      findShift_m(old.T_map_body, T_map_new, kShiftDistance_m) <= rule.tolerance_m;
  return is_tolerated ? old.T_map_body : T_map_new;
}

void MapCorrection::Implementation::put(const HistoryEvent& event, const std::string& packed,
                                        double step_m, CloudReplay& replay) {
  if (!event.isCloud()) {
    replay.wait();
    putEdit(event);
    return poses.push_back(Eigen::Isometry3d::Identity());
  }
  const Eigen::Isometry3d T_map_body = newPose(event.pose);
  motion = motionOf(event);
  replay.put(unpackScans(packed, step_m), T_map_body, *event.config);
  poses.push_back(T_map_body);
  ++num_clouds;
  num_outside += track.covers(event.pose.stamp_ns) ? 0 : 1;
  const double shift_m = (T_map_body.translation() - event.pose.T_map_body.translation()).norm();
  max_shift_m = std::max(max_shift_m, shift_m);
}

Eigen::Isometry3d MapCorrection::Implementation::motionOf(const HistoryEvent& cloud) const {
  if (!moves(cloud)) return Eigen::Isometry3d::Identity();
  return newPose(cloud.pose) * cloud.pose.T_map_body.inverse();
}

Cell MapCorrection::Implementation::shiftOf(const HistoryEvent& edit,
                                            const Eigen::Isometry3d& motion_map) const {
  if (!rule.edits_move || edit.whole.isEmpty()) return {0, 0, 0};
  const Eigen::Vector3d center = map.grid().centerOf(edit.whole);
  const Eigen::Vector3d shift = (motion_map * center - center) / map.grid().resolution();
  constexpr double kMost = Grid::kMaxCell;
  Cell cells{};
  for (int axis = 0; axis < 3; ++axis) {
    cells[axis] = static_cast<std::int32_t>(std::lround(std::clamp(shift[axis], -kMost, kMost)));
  }
  return cells;
}

void MapCorrection::Implementation::putEdit(const HistoryEvent& edit) {
  if (rule.edits_move) return putMovedEdit(edit);
  map.setLocked(edit.locked);
  map.replace(edit.box, edit.bricks);
}

void MapCorrection::Implementation::putMovedEdit(const HistoryEvent& edit) {
  HistoryEvent moved = translated(edit, shiftOf(edit, motion), map.grid().resolution());
  for (const CellBox& box : moved.newly_unlocked) map.unlock(box);
  for (const CellBox& box : moved.newly_locked) map.lock(box);
  map.replace(moved.box, moved.bricks);
  moved.locked = map.lockedBoxes();
  moved_edits[poses.size()] = std::move(moved);
}

}  // namespace cuboid_mapping
