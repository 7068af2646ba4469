// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "face_mesh.h"

#include <OgreColourValue.h>
#include <OgreMaterial.h>
#include <OgreVector3.h>

#include <limits>
#include <optional>

namespace cuboid_mapping_rviz {

/// Meaning of colours. The shader has the same numbers.
enum class ColorMode : unsigned char { kHeight, kProbability, kSize, kFlat };

/// Style of faces. The shader gets all of it, so that a change leaves vertices as they are.
struct FaceStyle {
  ColorMode mode = ColorMode::kHeight;
  Ogre::ColourValue color{0.3F, 0.55F, 0.9F};  ///< Colour for ColorMode::kFlat.
  float alpha = 1.0F;
  bool has_edges = true;
  bool is_coarse = false;    ///< Style of coarse faces, which have no edges.
  float min_color_m = 0.0F;  ///< Heights of the first and the last colour.
  float max_color_m = 1.0F;
  Ogre::Vector3 min_clip{
      -std::numeric_limits<float>::max()};  ///< Corners of the shown part, map frame.
  Ogre::Vector3 max_clip{std::numeric_limits<float>::max()};
  /// Height of the cross sections, map frame, which are visible from both sides; nothing for faces.
  std::optional<float> slice_m;
  float oldest_s =
      -std::numeric_limits<float>::max();  ///< Hides bricks that changed before this time.
};

[[nodiscard]] bool isTransparent(const FaceStyle& style);
/// Whether back faces are drawn, too.
[[nodiscard]] bool hasTwoSides(const FaceStyle& style);

/// Index of the custom parameter of a renderable with the least corner of its chunk in the map frame, and the
/// resolution.
constexpr std::size_t kChunkParameter = 20;

/// A material for faces of one FaceSet.
class FaceMaterial {
 public:
  FaceMaterial();
  ~FaceMaterial();
  FaceMaterial(const FaceMaterial&) = delete;
  FaceMaterial& operator=(const FaceMaterial&) = delete;

  void setStyle(const FaceStyle& style);
  [[nodiscard]] const Ogre::MaterialPtr& get() const { return material_; }

 private:
  Ogre::MaterialPtr material_;
};

}  // namespace cuboid_mapping_rviz
