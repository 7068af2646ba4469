// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <OgreHardwareIndexBuffer.h>

#include <cstddef>

namespace cuboid_mapping_rviz {

/// Index buffer with two triangles for each four vertices, shared by all chunks.
class FaceIndices {
 public:
  /// A buffer for at least this many faces. Buffers of earlier calls stay valid.
  const Ogre::HardwareIndexBufferSharedPtr& forFaces(std::size_t num_faces);

 private:
  Ogre::HardwareIndexBufferSharedPtr short_;  ///< Indices of 16 bits, for most chunks.
  Ogre::HardwareIndexBufferSharedPtr long_;
};

}  // namespace cuboid_mapping_rviz
