// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <OgreManualObject.h>
#include <OgreMaterial.h>
#include <OgreSceneNode.h>
#include <OgreTexture.h>

#include <array>
#include <cstdint>
#include <vector>

namespace cuboid_mapping_rviz {

/// A horizontal picture in a scene, visible from both sides, with sharp pixels. Thread rule: that of rviz.
class FlatImage {
 public:
  using Pixel = std::array<std::uint8_t, 4>;  ///< Red, green, blue, alpha.

  /// @param parent  Must outlive this object.
  explicit FlatImage(Ogre::SceneNode& parent);
  ~FlatImage();
  FlatImage(const FlatImage&) = delete;
  FlatImage& operator=(const FlatImage&) = delete;

  /// @param pixels  Row by row along x, not empty. @param width  Length of a row.
  /// @param corner  Least corner, in the frame of the parent.
  void show(const std::vector<Pixel>& pixels, std::size_t width, const Ogre::Vector3& corner,
            float pixel_m);

 private:
  void removeTexture();

  Ogre::SceneNode& node_;
  Ogre::ManualObject& plane_;
  Ogre::MaterialPtr material_;
  Ogre::TexturePtr texture_;
};

}  // namespace cuboid_mapping_rviz
