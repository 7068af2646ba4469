// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "face_indices.h"
#include "face_mesh.h"

#include <OgreMaterial.h>
#include <OgreMovableObject.h>
#include <OgreRenderable.h>

#include <cstdint>
#include <memory>

namespace cuboid_mapping_rviz {

/// Shared data of the chunks of a FaceSet.
struct ChunkStyle {
  Ogre::MaterialPtr material;         ///< Material of the faces of cuboids.
  Ogre::MaterialPtr coarse_material;  ///< Material of coarse faces.
  bool has_coarse = false;            ///< Whether coarse faces may be drawn.
  bool is_opaque = true;              ///< Near chunks are drawn first, and hide what lies behind.
  bool has_two_sides = false;         ///< Back faces are drawn, too.
  /// Maximum size of a coarse cell on the screen, in pixels; 0: no coarse faces.
  float max_cell_pixels = 0.0F;
};

/// The faces of one chunk on the graphics card: 16 bytes a vertex, 64 bytes a face.
class FaceChunk : public Ogre::MovableObject {
 public:
  /// Place of a chunk.
  struct Place {
    cuboid_mapping::Cell chunk;
    double resolution_m = 0.0;
  };

  /// @param node  Node in the map frame. It and the style must outlive this object.
  FaceChunk(Ogre::SceneNode& node, const Place& place, const ChunkStyle& style);
  ~FaceChunk() override;
  FaceChunk(const FaceChunk&) = delete;
  FaceChunk& operator=(const FaceChunk&) = delete;

  /// Replaces the faces on the graphics card. @return Number of uploaded bytes.
  std::size_t upload(const FaceMesh& mesh, FaceIndices& indices);

  /// Number of faces of cuboids, without coarse faces.
  [[nodiscard]] std::size_t numFaces() const { return levels_[0].count(); }
  [[nodiscard]] std::size_t numCuboids() const { return num_cuboids_; }
  /// Size of the vertices on the card, coarse faces included.
  [[nodiscard]] std::size_t numBytes() const { return num_vertices_ * sizeof(FaceVertex); }

  /// Chooses the faces for the place of the camera. Picking always uses the faces of cuboids.
  void _notifyCurrentCamera(Ogre::Camera* camera) override;
  void _updateRenderQueue(Ogre::RenderQueue* queue) override;
  void visitRenderables(Ogre::Renderable::Visitor* visitor, bool is_debug) override;
  const Ogre::String& getMovableType() const override;
  const Ogre::AxisAlignedBox& getBoundingBox() const override { return bounds_; }
  Ogre::Real getBoundingRadius() const override;

 private:
  /// Faces next to each other in memory: one draw call.
  class Run : public Ogre::Renderable {
   public:
    explicit Run(const FaceChunk& chunk) : chunk_(&chunk) {}

    const Ogre::MaterialPtr& getMaterial() const override;
    void getRenderOperation(Ogre::RenderOperation& operation) override;
    void getWorldTransforms(Ogre::Matrix4* transform) const override;
    Ogre::Real getSquaredViewDepth(const Ogre::Camera* camera) const override;
    const Ogre::LightList& getLights() const override { return chunk_->queryLights(); }

    Ogre::IndexData indices;

   private:
    const FaceChunk* chunk_;
  };

  [[nodiscard]] std::size_t levelFor(const Ogre::Camera& camera, double distance_m) const;
  /// Whether sides of cuboids are visible, by side.
  using Sides = std::array<bool, kSideOrder.size()>;
  [[nodiscard]] Sides sidesFor(const Ogre::Camera& camera) const;
  [[nodiscard]] std::uint16_t drawOrderFor(double distance_m) const;
  void choose(const FaceMesh::Part& part, const Sides& sides);
  void addRun(std::size_t begin, std::size_t end);

  Ogre::SceneNode* node_;
  const ChunkStyle* style_;
  double resolution_m_;
  std::unique_ptr<Ogre::VertexData> vertex_data_;
  std::array<Run, 3> runs_{Run(*this), Run(*this),
                           Run(*this)};  ///< Runs: three suffice for six sides.
  std::size_t num_runs_ = 0;             ///< Number of drawn runs.
  Ogre::AxisAlignedBox bounds_;
  std::array<FaceMesh::Part, kNumDetailLevels> levels_;
  bool is_coarse_ = false;  ///< Whether the drawn level is coarse.
  std::uint16_t draw_order_ = 0;
  std::size_t num_vertices_ = 0;
  std::size_t num_cuboids_ = 0;
};

}  // namespace cuboid_mapping_rviz
