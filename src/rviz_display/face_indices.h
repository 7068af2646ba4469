// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <OgreHardwareIndexBuffer.h>

#include <cstddef>

namespace cuboid_mapping_rviz {

/// Two triangles for each four vertices: the same for all chunks, which share it.
class FaceIndices {
 public:
  /// A buffer for so many faces, or more. Others, that were given before, stay valid.
  const Ogre::HardwareIndexBufferSharedPtr& forFaces(std::size_t num_faces);

 private:
  Ogre::HardwareIndexBufferSharedPtr short_;  ///< Of 16 bits, for most.
  Ogre::HardwareIndexBufferSharedPtr long_;
};

}  // namespace cuboid_mapping_rviz
