// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "face_indices.h"
#include "face_mesh.h"

#include <OgreMaterial.h>
#include <OgreSimpleRenderable.h>

#include <memory>

namespace cuboid_mapping_rviz {

/// What the chunks of a FaceSet share.
struct ChunkStyle {
  Ogre::MaterialPtr material;         ///< Of the faces of cuboids.
  Ogre::MaterialPtr coarse_material;  ///< Of coarse faces.
  bool has_coarse = false;            ///< Whether they may be drawn.
  /// Coarse faces are drawn whose cells take so many pixels at most; 0: none are.
  float max_cell_pixels = 0.0F;
};

/// The faces of one chunk on the graphics card: 16 bytes a vertex, 64 bytes a face.
class FaceChunk : public Ogre::SimpleRenderable {
 public:
  /// Where a chunk lies.
  struct Place {
    cuboid_mapping::Cell chunk;
    double resolution_m = 0.0;
  };

  /// @param node  In the map frame. It and the style must outlive this object.
  FaceChunk(Ogre::SceneNode& node, const Place& place, const ChunkStyle& style);
  ~FaceChunk() override;
  FaceChunk(const FaceChunk&) = delete;
  FaceChunk& operator=(const FaceChunk&) = delete;

  /// Uploads faces in the place of those before. @return Bytes that were uploaded.
  std::size_t upload(const FaceMesh& mesh, FaceIndices& indices);

  /// Of cuboids, without the coarse ones.
  [[nodiscard]] std::size_t numFaces() const { return levels_[0].count; }
  [[nodiscard]] std::size_t numCuboids() const { return num_cuboids_; }
  /// Of the vertices on the card, with those of coarse faces.
  [[nodiscard]] std::size_t numBytes() const { return num_vertices_ * sizeof(FaceVertex); }

  /// Chooses the faces for the distance of the camera. Those of the cuboids are always picked.
  void _notifyCurrentCamera(Ogre::Camera* camera) override;
  const Ogre::MaterialPtr& getMaterial() const override;
  Ogre::Real getBoundingRadius() const override;
  Ogre::Real getSquaredViewDepth(const Ogre::Camera* camera) const override;

 private:
  void choosePart(const FaceMesh::Part& part);
  [[nodiscard]] std::size_t levelFor(const Ogre::Camera& camera) const;

  Ogre::SceneNode* node_;
  const ChunkStyle* style_;
  double resolution_m_;
  std::unique_ptr<Ogre::VertexData> vertex_data_;
  std::unique_ptr<Ogre::IndexData> index_data_;
  std::array<FaceMesh::Part, kNumDetailLevels> levels_;
  bool is_coarse_ = false;  ///< Of the level that is drawn.
  std::size_t num_vertices_ = 0;
  std::size_t num_cuboids_ = 0;
};

}  // namespace cuboid_mapping_rviz
