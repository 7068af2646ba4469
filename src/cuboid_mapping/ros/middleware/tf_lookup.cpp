// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/middleware/tf_lookup.h"

#include "cuboid_mapping/geometry/rounded_transform.h"

#include "cuboid_mapping/ros/middleware/transforms.h"

#include <tf2_eigen/tf2_eigen.h>

#include <exception>

namespace cuboid_mapping_ros {

std::string withoutSlash(const std::string& frame_id) {
  return !frame_id.empty() && frame_id.front() == '/' ? frame_id.substr(1) : frame_id;
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
    result.T_target_source = cuboid_mapping::roundTransform(tf2::transformToEigen(
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

cuboid_mapping::MetricBox computeEnclosingBox(const Eigen::Isometry3d& T_target_source,
                                              const cuboid_mapping::MetricBox& box_source) {
  const Eigen::Vector3d center_source = 0.5 * (box_source.min_m + box_source.max_m);
  const Eigen::Vector3d half_source_m = 0.5 * (box_source.max_m - box_source.min_m);
  const Eigen::Vector3d center = T_target_source * center_source;
  const Eigen::Vector3d half_m = T_target_source.linear().cwiseAbs() * half_source_m;
  return {center - half_m, center + half_m};
}

}  // namespace cuboid_mapping_ros
