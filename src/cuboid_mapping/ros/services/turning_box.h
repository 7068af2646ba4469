// SPDX-License-Identifier: BSD-3-Clause
// Reads the turning box of requests with `headings`.
#pragma once

#include "cuboid_mapping/query/pose_query.h"
#include "cuboid_mapping/ros/services/service_call.h"

namespace cuboid_mapping_ros {

/// A box with its origin in the middle, inflated on all sides. Throws a Refusal.
[[nodiscard]] cuboid_mapping::Body readTurningBox(const ServiceCall& call,
                                                  const geometry_msgs::Vector3& size,
                                                  double inflation_m);

/// A pose in the frame of the map. Throws a Refusal. @param heading_rad  About z of the request's frame.
[[nodiscard]] Eigen::Isometry3d readHeaded(const ServiceCall& call,
                                           const geometry_msgs::Point& point,
                                           const FieldName& field, double heading_rad);

}  // namespace cuboid_mapping_ros
