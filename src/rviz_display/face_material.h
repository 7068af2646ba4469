// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "face_mesh.h"

#include <OgreColourValue.h>
#include <OgreMaterial.h>
#include <OgreVector3.h>

#include <array>
#include <limits>
#include <optional>

namespace cuboid_mapping_rviz {

/// Meaning of colours. The numbers are those of the shader.
enum class ColorMode : unsigned char { kHeight, kProbability, kSize, kFlat };

/// How faces look; all of it is told to the shader, so that no vertex changes with it.
struct FaceStyle {
  ColorMode mode = ColorMode::kHeight;
  Ogre::ColourValue color{0.3F, 0.55F, 0.9F};  ///< With ColorMode::kFlat.
  float alpha = 1.0F;
  bool has_edges = true;
  bool is_coarse = false;    ///< For coarse faces; they have no edges.
  float min_color_m = 0.0F;  ///< Heights of the ends of the colours.
  float max_color_m = 1.0F;
  Ogre::Vector3 min_clip{-std::numeric_limits<float>::max()};  ///< In the map frame: what is shown.
  Ogre::Vector3 max_clip{std::numeric_limits<float>::max()};
  /// Height of the cross sections, in the map frame; they are seen from both sides. Faces have none.
  std::optional<float> slice_m;
  float oldest_s = -std::numeric_limits<float>::max();  ///< Changed before: not shown.
};

[[nodiscard]] bool isTransparent(const FaceStyle& style);
/// Whether faces are drawn that turn their back to the camera, too.
[[nodiscard]] bool hasTwoSides(const FaceStyle& style);

/// Index of the custom parameter of a renderable that holds the least corner of its chunk in the map
/// frame, and the resolution.
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
