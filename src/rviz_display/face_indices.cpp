// SPDX-License-Identifier: BSD-3-Clause
#include "face_indices.h"

#include <OgreHardwareBufferManager.h>

#include <algorithm>
#include <cstdint>

namespace cuboid_mapping_rviz {
namespace {

/// Maximum number of faces whose vertices 16 bits can number.
constexpr std::size_t kMostOf16Bits = 65536 / 4;

template <typename IndexT>
Ogre::HardwareIndexBufferSharedPtr make(Ogre::HardwareIndexBuffer::IndexType type,
                                        std::size_t num_faces) {
  Ogre::HardwareIndexBufferSharedPtr buffer =
      Ogre::HardwareBufferManager::getSingleton().createIndexBuffer(
          type, 6 * num_faces, Ogre::HardwareBuffer::HBU_STATIC_WRITE_ONLY);
  auto* index = static_cast<IndexT*>(buffer->lock(Ogre::HardwareBuffer::HBL_DISCARD));
  for (std::size_t face = 0; face < num_faces; ++face) {
    for (const std::size_t corner : {0, 1, 2, 0, 2, 3}) {
      *index++ = static_cast<IndexT>(4 * face + corner);
    }
  }
  buffer->unlock();
  return buffer;
}

}  // namespace

const Ogre::HardwareIndexBufferSharedPtr& FaceIndices::forFaces(std::size_t num_faces) {
  if (num_faces <= kMostOf16Bits) {
    if (short_.get() == nullptr) {
      short_ = make<std::uint16_t>(Ogre::HardwareIndexBuffer::IT_16BIT, kMostOf16Bits);
    }
    return short_;
  }
  if (long_.get() == nullptr || long_->getNumIndexes() < 6 * num_faces) {
    long_ = make<std::uint32_t>(Ogre::HardwareIndexBuffer::IT_32BIT,
                                std::max(2 * kMostOf16Bits, 2 * num_faces));
  }
  return long_;
}

}  // namespace cuboid_mapping_rviz
