// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/clouds/moving_filter.h"

#include "cuboid_mapping/map/locked_boxes.h"
namespace cuboid_mapping_ros {

std::vector<Eigen::Vector3d> MovingFilter::findMoving(const std::vector<Scan>& scans) const {
  std::vector<Eigen::Vector3d> moving;
  if (is_reset_) return moving;
  for (const Scan& scan : scans) {
    for (const Eigen::Vector3f& point : scan.points) {
      const Eigen::Vector3d point_map = scan.anchor_map + point.cast<double>();
      const auto cell = grid_.toCell(point_map);
      if (cell && void_space_.contains(*cell)) moving.push_back(point_map);
    }
  }
  return moving;
}

const ScanUpdate& MovingFilter::take(const ScanUpdate& update,
                                     const Eigen::Vector3d& window_center_map) {
  if (is_reset_.exchange(false)) void_space_ = {};
  if (what_ == MovingPoints::kIgnore) return update;
  const bool leaves_out = what_ == MovingPoints::kLeaveOut;
  if (leaves_out) rest_ = void_space_.withoutMoving(update);
  void_space_.add(update);
  if (window_.isOn()) {
    void_space_.forgetOutside(cellsKeptAround(window_center_map, window_.config, grid_),
                              window_.config.idleSteps());
  }
  return leaves_out ? rest_ : update;
}

std::size_t freeVoidVoxels(const VoidSpace& void_space, CuboidMap& map) {
  std::size_t num_freed = 0;
  void_space.forEach([&](const Cell& brick, const BrickMask& mask) {
    const PackedVoxels* voxels = map.voxels().find(brick);
    if (voxels == nullptr) return;
    std::vector<BrickUpdate> passed(1);
    passed[0].brick = brick;
    passed[0].misses = voxels->occupied() & mask;
    passed = map.locked().without(passed);
    if (passed[0].misses.isEmpty()) return;
    const SensorModel& model = map.sensorModel();
    PackedVoxels free;
    PackedVoxels().observe({}, passed[0].misses, model, free);
    PackedVoxels changed = *voxels;
    changed.replace(passed[0].misses, free, changed);
    (void)map.replace(brickBox(brick), std::vector<VoxelBrick>{{brick, changed}});
    num_freed += static_cast<std::size_t>(passed[0].misses.count());
  });
  return num_freed;
}

}  // namespace cuboid_mapping_ros
