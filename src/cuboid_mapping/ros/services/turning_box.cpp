// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/services/turning_box.h"

#include <cmath>

namespace cuboid_mapping_ros {

cuboid_mapping::Body readTurningBox(const ServiceCall& call, const geometry_msgs::Vector3& size,
                                    double inflation_m) {
  cuboid_mapping::BodyBox box;
  box.size_m = ServiceCall::edges(size);
  box.size_m.array() += 2.0 * ServiceCall::notNegative(inflation_m, "inflation");
  cuboid_mapping::Body body{{}, {box}};
  const std::string fault = findFault(body, call.map().grid());
  if (!fault.empty()) throw Refusal("size, as a body with one box: " + fault);
  return body;
}

Eigen::Isometry3d readHeaded(const ServiceCall& call, const geometry_msgs::Point& point,
                             const FieldName& field, double heading_rad) {
  if (!std::isfinite(heading_rad)) {
    throw Refusal("the heading of " + std::string(field.name) +
                  (field.element ? '[' + std::to_string(*field.element) + ']' : "") +
                  " is NaN or infinite: give an angle in radians");
  }
  geometry_msgs::Pose pose;
  pose.position = point;
  pose.orientation.z = std::sin(0.5 * heading_rad);
  pose.orientation.w = std::cos(0.5 * heading_rad);
  return call.pose(pose, field);
}

}  // namespace cuboid_mapping_ros
