// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/middleware/tf_lookup.h"

#include "cuboid_mapping/geometry/rounded_transform.h"
#include "cuboid_mapping/io/text.h"

#include <tf2_eigen/tf2_eigen.h>

#include <algorithm>
#include <cmath>
#include <exception>

namespace cuboid_mapping_ros {
namespace {

/// Frames of tf without a parent, in order of their names.
std::vector<std::string> findRoots(const tf2::BufferCore& tf) {
  std::vector<std::string> frames;
  tf._getFrameStrings(frames);
  std::vector<std::string> roots;
  std::string parent;
  for (const std::string& frame : frames) {
    if (!tf._getParent(frame, ros::Time(), parent)) roots.push_back(frame);
  }
  std::sort(roots.begin(), roots.end());
  return roots;
}

/// Advice if tf does not connect two frames: names the roots; empty if tf connects them at some time.
/// @param target  The frame of the map. Names have no slash at the start.
std::string adviseOnTree(const tf2::BufferCore& tf, const std::string& target,
                         const std::string& source) {
  const auto root_of_target = findRoot(tf, target);
  const auto root_of_source = findRoot(tf, source);
  if (root_of_target && root_of_target == root_of_source) return "";
  const std::vector<std::string> roots = findRoots(tf);
  std::string advice = roots.empty() ? "tf has no frame at all"
                                     : "the roots of tf's trees are: " + join(roots, ", ");
  if (root_of_source) {
    advice +=
        ". '" + source + "' is below '" + *root_of_source + "': set frame_id to " + *root_of_source;
  } else {
    advice += ". Nobody publishes '" + source + "': start its publisher";
  }
  return advice + ", or give the missing transform: \"" + target + ' ' +
         root_of_source.value_or(source) +
         " x y z yaw pitch roll\" (publish_transforms; replay.launch: transform:=; bag_to_map: "
         "--transform)";
}

}  // namespace

std::string withoutSlash(const std::string& frame_id) {
  return !frame_id.empty() && frame_id.front() == '/' ? frame_id.substr(1) : frame_id;
}

std::vector<std::string> findAncestors(const tf2::BufferCore& tf, const std::string& frame_id) {
  std::vector<std::string> frame_ids{withoutSlash(frame_id)};
  std::string parent;
  // Two faulty programs could have made frames each other's parents.
  while (frame_ids.size() < tf2::BufferCore::MAX_GRAPH_DEPTH &&
         tf._getParent(frame_ids.back(), ros::Time(), parent)) {
    frame_ids.push_back(parent);
  }
  return frame_ids;
}

std::optional<std::string> findRoot(const tf2::BufferCore& tf, const std::string& frame_id) {
  if (!tf._frameExists(withoutSlash(frame_id))) return std::nullopt;
  return findAncestors(tf, frame_id).back();
}

TfLookup lookupTransform(const tf2::BufferCore& buffer, const std::string& target,
                         const std::string& source, const ros::Time& stamp) {
  const std::string target_frame = withoutSlash(target);
  const std::string source_frame = withoutSlash(source);
  TfLookup result;
  if (target_frame == source_frame) {
    result.T_target_source = Eigen::Isometry3d::Identity();  // also if tf does not know the frame
    return result;
  }
  try {
    result.T_target_source = roundTransform(tf2::transformToEigen(
        tidyTransform(buffer.lookupTransform(target_frame, source_frame, stamp))));
  } catch (const std::exception& exception) {
    // Comes from tf, or from ros::Time for stamps 2^31 s apart.
    result.error = exception.what();
    // tf2 leaves out the cause if its buffer was cleared, and begins with ", when looking up".
    if (result.error.rfind(", ", 0) == 0) result.error.insert(0, "tf has no data yet");
    result.error.erase(result.error.find_last_not_of(" .") + 1);  // many end with ". ."
    const std::string advice = adviseOnTree(buffer, target_frame, source_frame);
    if (!advice.empty()) result.error += "; " + advice;
  }
  return result;
}

MetricBox computeEnclosingBox(const Eigen::Isometry3d& T_target_source,
                              const MetricBox& box_source) {
  const Eigen::Vector3d center_source = 0.5 * (box_source.min_m + box_source.max_m);
  const Eigen::Vector3d half_source_m = 0.5 * (box_source.max_m - box_source.min_m);
  const Eigen::Vector3d center = T_target_source * center_source;
  const Eigen::Vector3d half_m = T_target_source.linear().cwiseAbs() * half_source_m;
  return {center - half_m, center + half_m};
}

geometry_msgs::TransformStamped tidyTransform(geometry_msgs::TransformStamped transform) {
  transform.header.frame_id = withoutSlash(transform.header.frame_id);
  transform.child_frame_id = withoutSlash(transform.child_frame_id);
  geometry_msgs::Quaternion& q = transform.transform.rotation;
  const double length = std::sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w);
  constexpr double kRounding = 1e-12;  // Rotations within it keep their bits.
  constexpr double kMaxError = 0.1;
  if (std::abs(length - 1.0) <= kRounding || !(std::abs(length - 1.0) <= kMaxError))
    return transform;
  for (double* number : {&q.x, &q.y, &q.z, &q.w}) *number /= length;
  return transform;
}

}  // namespace cuboid_mapping_ros
