// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/grid.h"
#include "cuboid_mapping/ros/mapping/sensor_step.h"
#include "cuboid_mapping/ros/self_filter/robot_description.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <cstddef>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {

/// Shapes of the robot, and the treatment of points on it.
struct SelfFilterParameters {
  XmlRpc::XmlRpcValue box_list;  ///< List as given.
  RobotParts boxes;              ///< Boxes from the list.
  /// Name of a parameter with a URDF, or a .urdf file; empty: none.
  std::string robot_description;
  double padding_m = 0.05;    ///< Enlarges the shapes of the URDF.
  std::string ignored_links;  ///< Links of the URDF, separated by spaces.
  bool keep_free = true;      ///< Whether each cloud makes the voxels of the robot free.
  RobotParts parts;           ///< All parts, after readReferences().
};

/// Fills SelfFilterParameters::parts with the parts of the robot: its boxes, then the shapes of its description.
///
/// @param find_text  Reads self_filter/robot_description, unless that is a .urdf file.
/// @throws std::runtime_error  for a missing file or parameter, errors of readRobotDescription(), and
///         a robot with too many voxels to keep free.
void loadRobotParts(NodeParameters& parameters, const FindText& find_text);

/// Removes points in padded parts. The others keep their order.
/// @param T_part_points  For each part, the transform of points to its frame.
/// @return Number of removed points. @complexity O(points * parts); most points cost one comparison.
std::size_t removePointsOnRobot(const RobotParts& parts,
                                const std::vector<Eigen::Isometry3d>& T_part_points,
                                std::vector<Eigen::Vector3f>& points);

/// Voxels whose centre lies in a part, without padding; a voxel in two parts comes twice.
/// @param T_map_part  For each part, its pose. @return Centres, relative to `anchor_map`.
/// @complexity O(volume, in voxels, of the boxes around the parts in the map).
[[nodiscard]] std::vector<Eigen::Vector3f> findRobotVoxels(
    const RobotParts& parts, const std::vector<Eigen::Isometry3d>& T_map_part, const Grid& grid,
    const Eigen::Vector3d& anchor_map);

/// Points on the robot are left out, with their beams.
class SelfFilterStep : public SensorStep {
 public:
  SelfFilterStep(const NodeParameters& parameters, const SourceParameters& /*source*/)
      : parameters_(parameters.of<SelfFilterParameters>()), grid_(parameters.map.resolution_m) {}

  [[nodiscard]] static std::vector<ParameterDeclaration> declare();
  /// loadRobotParts().
  static void readReferences(NodeParameters& parameters, const FindText& find_text);
  [[nodiscard]] static bool isOn(const NodeParameters& parameters,
                                 const SourceParameters& /*source*/) {
    return !parameters.of<SelfFilterParameters>().parts.empty();
  }

  [[nodiscard]] std::vector<StepFrame> frames() const override;
  void apply(SensorPart& part, const StepPoses& poses, CloudFigures& figures) const override;
  [[nodiscard]] std::vector<Eigen::Vector3f> findFreePoints(
      const StepPoses& poses, const Eigen::Vector3d& anchor_map) const override;

 private:
  SelfFilterParameters parameters_;
  Grid grid_;
};

}  // namespace cuboid_mapping_ros
