// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/middleware/tf_lookup.h"

#include <geometry_msgs/TransformStamped.h>

#include <cmath>
#include <map>
#include <string>

namespace cuboid_mapping_ros {

/// Notices that two publishers give one frame different static transforms: the last one holds, which may be either.
class StaticPublishers {
 public:
  /// Notes a static transform. @return A warning, once for each frame; empty if nothing contradicts it.
  std::string note(const geometry_msgs::TransformStamped& given, const std::string& publisher) {
    const geometry_msgs::TransformStamped transform = tidyTransform(given);
    Frame& frame = frames_[transform.child_frame_id];
    frame.transforms[publisher] = transform;
    for (const auto& [other, its] : frame.transforms) {
      if (frame.is_said || other == publisher || !differ(its, transform)) continue;
      frame.is_said = true;
      std::string warning = "'" + transform.child_frame_id;
      warning.append("' has different static transforms from ").append(other).append(" and ");
      return warning.append(publisher).append(": the last one holds. Stop one of them");
    }
    return "";
  }

 private:
  struct Frame {
    std::map<std::string, geometry_msgs::TransformStamped> transforms;  ///< By publisher.
    bool is_said = false;
  };

  static bool differ(const geometry_msgs::TransformStamped& a,
                     const geometry_msgs::TransformStamped& b) {
    constexpr double kLeast_m = 1e-3;
    constexpr double kLeastCosine = 1.0 - 1e-6;  ///< Of half the angle.
    const auto& p = a.transform.translation;
    const auto& q = b.transform.translation;
    const auto& r = a.transform.rotation;
    const auto& s = b.transform.rotation;
    const double cosine = r.x * s.x + r.y * s.y + r.z * s.z + r.w * s.w;
    return a.header.frame_id != b.header.frame_id || std::abs(cosine) < kLeastCosine ||
           std::hypot(p.x - q.x, p.y - q.y, p.z - q.z) > kLeast_m;
  }

  std::map<std::string, Frame> frames_;
};

}  // namespace cuboid_mapping_ros
