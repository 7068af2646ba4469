// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "flat_image.h"
#include "map_layer.h"

#include "cuboid_mapping/query/distance_field.h"

#include <memory>
#include <optional>
#include <vector>

namespace rviz {
class FloatProperty;
}  // namespace rviz

namespace cuboid_mapping_rviz {

/// Colours of a layer of voxels by DistanceField, their distance to the nearest occupied voxel: from red (0)
/// over green to blue (the bound, and farther); unknown voxels are transparent.
///
/// Keeps the distances of the last layer. If the next layer is the same, it updates them in changed bricks
/// only.
class DistanceColors {
 public:
  /// @param layer  Not empty, one voxel high. @return Its voxels, row by row along x.
  /// @throws std::invalid_argument  The bound is not > 0, or more than 127 voxels.
  [[nodiscard]] std::vector<FlatImage::Pixel> update(cuboid_mapping::CuboidMap map,
                                                     const cuboid_mapping::CellBox& layer,
                                                     double bound_m);

 private:
  /// Data of the last call.
  struct Kept {
    cuboid_mapping::CuboidMap map;
    cuboid_mapping::DistanceField field;
    double bound_m;
  };
  std::optional<Kept> kept_;
};

/// A horizontal slice of the distances to obstacles.
class DistanceLayer : public MapLayer {
 public:
  explicit DistanceLayer(rviz::Display& display);

 private:
  [[nodiscard]] Job makeJob(const cuboid_mapping::CuboidMap& map, const ViewRay& ray) override;
  void hide() override;

  struct Place {
    cuboid_mapping::CellBox layer;
    double height_m;
    double resolution_m;
  };
  QString draw(Ogre::SceneNode& node, const std::vector<FlatImage::Pixel>& pixels,
               const Place& place);

  rviz::FloatProperty* height_property_;
  rviz::FloatProperty* bound_property_;
  std::unique_ptr<FlatImage> image_;
  std::shared_ptr<DistanceColors> colors_ =
      std::make_shared<DistanceColors>();  ///< Shared with the jobs.
};

}  // namespace cuboid_mapping_rviz
