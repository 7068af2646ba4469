// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/start/start_volume.h"

#include "cuboid_mapping/ros/middleware/tf_lookup.h"
#include "cuboid_mapping/ros/parameters/parameter_table.h"
#include "cuboid_mapping/scan/scan_filter.h"

#include <ros/console.h>

#include <cmath>
#include <optional>
#include <sstream>

namespace cuboid_mapping_ros {
namespace {

using P = NodeParameters;

/// Maximum number of voxels: they are made free while a cloud waits.
constexpr double kMaxStartVoxels = 1e6;

/// The box in "min_x min_y min_z max_x max_y max_z"; nothing for another text.
std::optional<MetricBox> readBox(const std::string& text) {
  std::istringstream words(text);
  MetricBox box;
  for (Eigen::Vector3d* corner : {&box.min_m, &box.max_m}) {
    for (int axis = 0; axis < 3; ++axis) words >> (*corner)[axis];
  }
  std::string rest;
  const bool is_box = !words.fail() && !(words >> rest) && box.min_m.allFinite() &&
                      box.max_m.allFinite() && (box.min_m.array() < box.max_m.array()).all();
  return is_box ? std::optional(box) : std::nullopt;
}

ParameterKind boxKind() {
  ParameterKind kind{"six numbers, min_x min_y min_z max_x max_y max_z, or empty"};
  kind.set = [](P& p, const XmlRpc::XmlRpcValue& value) -> std::string {
    const auto given = textOf(value);
    if (!given) return "put it in quotes";
    if (!given->empty() && !readBox(*given)) return "each min is less than its max";
    p.of<StartParameters>().box = *given;
    return {};
  };
  kind.get = [](const P& p) { return XmlRpc::XmlRpcValue(p.of<StartParameters>().box); };
  return kind;
}

}  // namespace

StartVolume::StartVolume(const MapHost& host)
    : host_(host), box_base_(readBox(host.parameters.of<StartParameters>().box).value()) {}

std::vector<ParameterDeclaration> StartVolume::declare() {
  return {{"start_free", "m", boxKind(),
           "Box in base_frame_id, such as '-0.6 -0.6 0 0.6 0.6 0.8'. With the first cloud, unknown "
           "voxels in it become free: the robot stands there, and no beam reaches them. Empty: "
           "none."}};
}

std::vector<ParameterError> StartVolume::check(const LoadedParameters& loaded) {
  const P& parameters = loaded.parameters;
  if (!isOn(parameters)) return {};
  const MetricBox box = readBox(parameters.of<StartParameters>().box).value();
  const double num_voxels =
      (box.max_m - box.min_m).prod() / std::pow(parameters.map.resolution_m, 3);
  if (num_voxels <= kMaxStartVoxels) return {};
  std::ostringstream text;
  text << "has " << num_voxels << " voxels, but may have " << kMaxStartVoxels
       << ": choose a smaller box";
  return {{"start_free", text.str()}};
}

void StartVolume::onCloud(const MappedCloud& cloud) {
  if (is_done_) return;
  const auto& base = host_.parameters.base_frame_id;
  const TfLookup lookup = lookupTransform(host_.tf, host_.parameters.frame_id, base, cloud.stamp);
  if (!lookup.T_target_source) {
    ROS_WARN_THROTTLE(10.0, "start_free waits for the transform of base_frame_id: %s",
                      lookup.error.c_str());
    return;
  }
  const MetricBox bounds = computeEnclosingBox(*lookup.T_target_source, box_base_);
  is_done_ = true;
  const auto cells = host_.map.grid().toCellBox(bounds);
  if (!cells) return;  // Out of range.
  host_.map.editIn(
      *cells, [&](CuboidMap& map) { return freeUnknown(map, *lookup.T_target_source, box_base_); });
}

ChangeSet freeUnknown(CuboidMap& map, const Eigen::Isometry3d& T_map_base,
                      const MetricBox& box_base) {
  ChangeSet changes{map.revision(), false, {}};
  const auto cells = map.grid().toCellBox(computeEnclosingBox(T_map_base, box_base));
  if (!cells) return changes;
  const Eigen::Isometry3d T_base_map = T_map_base.inverse();
  const auto is_unknown = [&](const Cell& cell) {
    return isInside(box_base, T_base_map * map.grid().centerOf(CellBox::ofCell(cell))) &&
           map.voxels().at(cell) == Occupancy::kUnknown;
  };
  for (Cell cell = cells->min; cell.x < cells->max.x; ++cell.x) {
    for (cell.y = cells->min.y; cell.y < cells->max.y; ++cell.y) {
      for (cell.z = cells->min.z; cell.z < cells->max.z; ++cell.z) {
        CellBox run = CellBox::ofCell(cell);
        while (cell.z < cells->max.z && is_unknown(cell)) ++cell.z;
        if (cell.z == run.min.z) continue;
        run.max.z = cell.z;
        changes.append(map.replace(run, {UniformBox{run, map.sensorModel().miss()}}));
      }
    }
  }
  return changes;
}

}  // namespace cuboid_mapping_ros
