// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "face_mesh.h"

#include <OgreMaterial.h>
#include <OgreSimpleRenderable.h>

#include <memory>

namespace cuboid_mapping_rviz {

/// The faces of one group on the graphics card: 16 bytes a vertex, 88 bytes a face at most.
class FaceChunk : public Ogre::SimpleRenderable {
 public:
  /// Where a group lies.
  struct Place {
    cuboid_mapping::Cell group;  ///< Its least cell.
    double resolution_m = 0.0;
  };

  /// @param node  In the map frame; must outlive this object.
  FaceChunk(Ogre::SceneNode& node, const Place& place, const Ogre::MaterialPtr& material);
  ~FaceChunk() override;
  FaceChunk(const FaceChunk&) = delete;
  FaceChunk& operator=(const FaceChunk&) = delete;

  /// Uploads faces in the place of those before. @return Bytes that were uploaded.
  std::size_t upload(const FaceMesh& mesh);

  [[nodiscard]] std::size_t numFaces() const { return num_faces_; }
  [[nodiscard]] std::size_t numCuboids() const { return num_cuboids_; }
  /// Of the buffers on the card.
  [[nodiscard]] std::size_t numBytes() const;

  Ogre::Real getBoundingRadius() const override;
  Ogre::Real getSquaredViewDepth(const Ogre::Camera* camera) const override;

 private:
  void uploadIndices();

  Ogre::SceneNode* node_;
  std::unique_ptr<Ogre::VertexData> vertex_data_;
  std::unique_ptr<Ogre::IndexData> index_data_;
  std::size_t num_faces_ = 0;
  std::size_t num_cuboids_ = 0;
};

}  // namespace cuboid_mapping_rviz
