// SPDX-License-Identifier: BSD-3-Clause
// The nodelet as pluginlib finds it.
#include "cuboid_mapping/ros/node/mapping_nodelet.h"

#include <pluginlib/class_list_macros.hpp>

PLUGINLIB_EXPORT_CLASS(cuboid_mapping_ros::MappingNodelet, nodelet::Nodelet)
