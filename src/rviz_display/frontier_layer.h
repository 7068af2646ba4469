// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "map_layer.h"

#include "cuboid_mapping/query/frontier_query.h"

#include <rviz/ogre_helpers/point_cloud.h>

#include <memory>

namespace rviz {
class IntProperty;
class VectorProperty;
}  // namespace rviz

namespace cuboid_mapping_rviz {

/// Points of the scene, relative to a corner near them.
struct FrontierPicture {
  using Points = std::vector<rviz::PointCloud::Point>;

  Ogre::Vector3 corner = Ogre::Vector3::ZERO;  ///< Corner in the map frame.
  Points voxels;  ///< Centres of voxels; each cluster has its own colour.
  Points places;  ///< Places where the robot fits, in the colour of their cluster.
  std::size_t num_clusters = 0;
  bool is_complete = true;
};

/// @param corner_map  Origin of the points.
[[nodiscard]] FrontierPicture drawFrontiers(const cuboid_mapping::Grid& grid,
                                            const std::vector<cuboid_mapping::Frontier>& frontiers,
                                            const Eigen::Vector3d& corner_map);

/// Points in a scene. Thread rule: that of rviz.
class ScenePoints {
 public:
  /// @param parent  Must outlive this object.
  ScenePoints(Ogre::SceneNode& parent, rviz::PointCloud::RenderMode mode);
  ~ScenePoints();
  ScenePoints(const ScenePoints&) = delete;
  ScenePoints& operator=(const ScenePoints&) = delete;

  /// Replaces the points. @param corner  Their origin, in the frame of the parent.
  void show(FrontierPicture::Points points, const Ogre::Vector3& corner, float size_m);

 private:
  Ogre::SceneNode& node_;
  rviz::PointCloud cloud_;
};

/// The voxels of the clusters of findFrontiers(), and spheres at the places where a robot could stand.
class FrontierLayer : public MapLayer {
 public:
  explicit FrontierLayer(rviz::Display& display);

 private:
  [[nodiscard]] Job makeJob(const cuboid_mapping::CuboidMap& map, const ViewRay& ray) override;
  void hide() override;
  QString draw(Ogre::SceneNode& node, const FrontierPicture& picture, double resolution_m);

  rviz::VectorProperty* robot_property_;
  rviz::IntProperty* least_property_;
  std::unique_ptr<ScenePoints> voxels_;
  std::unique_ptr<ScenePoints> places_;
};

}  // namespace cuboid_mapping_rviz
