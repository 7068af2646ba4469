// SPDX-License-Identifier: BSD-3-Clause
#include "face_chunk.h"

#include "face_material.h"

#include <OgreCamera.h>
#include <OgreHardwareBufferManager.h>
#include <OgreMaterialManager.h>
#include <OgreSceneManager.h>
#include <OgreSceneNode.h>
#include <OgreViewport.h>

#include <algorithm>
#include <cmath>

namespace cuboid_mapping_rviz {
namespace {

constexpr auto kEdge = static_cast<float>(kChunkEdge);

void declareVertex(Ogre::VertexDeclaration& declaration) {
  declaration.addElement(0, offsetof(FaceVertex, cell), Ogre::VET_SHORT4, Ogre::VES_POSITION);
  declaration.addElement(0, offsetof(FaceVertex, probability), Ogre::VET_COLOUR_ABGR,
                         Ogre::VES_DIFFUSE);
  declaration.addElement(0, offsetof(FaceVertex, changed_s), Ogre::VET_FLOAT1,
                         Ogre::VES_TEXTURE_COORDINATES, 0);
}

/// Of a metre at the nearest point of a box.
double pixelsPerMetre(const Ogre::Camera& camera, const Ogre::AxisAlignedBox& box) {
  const double height_pixels = camera.getViewport()->getActualHeight();
  if (camera.getProjectionType() == Ogre::PT_ORTHOGRAPHIC) {
    return height_pixels / camera.getOrthoWindowHeight();
  }
  const double distance_m = std::max<double>(box.distance(camera.getDerivedPosition()), 1e-3);
  return height_pixels / (2.0 * std::tan(0.5 * camera.getFOVy().valueRadians()) * distance_m);
}

}  // namespace

FaceChunk::FaceChunk(Ogre::SceneNode& node, const Place& place, const ChunkStyle& style)
    : node_(node.createChildSceneNode()),
      style_(&style),
      resolution_m_(place.resolution_m),
      vertex_data_(std::make_unique<Ogre::VertexData>()),
      index_data_(std::make_unique<Ogre::IndexData>()) {
  const auto resolution_m = static_cast<float>(place.resolution_m);
  const Ogre::Vector3 corner_map(static_cast<float>(place.chunk.x * place.resolution_m),
                                 static_cast<float>(place.chunk.y * place.resolution_m),
                                 static_cast<float>(place.chunk.z * place.resolution_m));
  node_->setPosition(corner_map);
  node_->setScale(resolution_m, resolution_m, resolution_m);
  declareVertex(*vertex_data_->vertexDeclaration);
  mRenderOp.operationType = Ogre::RenderOperation::OT_TRIANGLE_LIST;
  mRenderOp.useIndexes = true;
  mRenderOp.vertexData = vertex_data_.get();
  mRenderOp.indexData = index_data_.get();
  setCustomParameter(kChunkParameter, {corner_map.x, corner_map.y, corner_map.z, resolution_m});
  setBoundingBox({Ogre::Vector3::ZERO, Ogre::Vector3(kEdge)});
  node_->attachObject(this);
}

FaceChunk::~FaceChunk() {
  node_->detachAllObjects();
  node_->getCreator()->destroySceneNode(node_);
}

std::size_t FaceChunk::upload(const FaceMesh& mesh, FaceIndices& indices) {
  const bool is_as_many = mesh.vertices.size() == num_vertices_;
  num_vertices_ = mesh.vertices.size();
  num_cuboids_ = mesh.num_cuboids;
  levels_ = mesh.levels;
  setVisible(num_vertices_ > 0);
  if (num_vertices_ == 0) {
    vertex_data_->vertexBufferBinding->unsetAllBindings();
    index_data_->indexBuffer.reset();
    return 0;
  }
  if (!is_as_many) {
    vertex_data_->vertexBufferBinding->setBinding(
        0, Ogre::HardwareBufferManager::getSingleton().createVertexBuffer(
               sizeof(FaceVertex), num_vertices_, Ogre::HardwareBuffer::HBU_STATIC_WRITE_ONLY));
  }
  index_data_->indexBuffer = indices.forFaces(numFaces());
  choosePart(levels_[0]);
  vertex_data_->vertexBufferBinding->getBuffer(0)->writeData(0, numBytes(), mesh.vertices.data(),
                                                             true);
  return numBytes();
}

void FaceChunk::choosePart(const FaceMesh::Part& part) {
  is_coarse_ = part.is_coarse;
  vertex_data_->vertexStart = 4 * part.first;
  vertex_data_->vertexCount = 4 * part.count;
  index_data_->indexStart = 0;
  index_data_->indexCount = 6 * part.count;
}

std::size_t FaceChunk::levelFor(const Ogre::Camera& camera) const {
  if (!style_->has_coarse) return 0;
  const Ogre::Viewport* viewport = camera.getViewport();
  const bool is_picture = viewport != nullptr && viewport->getMaterialScheme() ==
                                                     Ogre::MaterialManager::DEFAULT_SCHEME_NAME;
  if (!is_picture) return 0;
  const double voxel_pixels = resolution_m_ * pixelsPerMetre(camera, node_->_getWorldAABB());
  std::size_t level = 0;
  while (level + 1 < kNumDetailLevels &&
         voxel_pixels * static_cast<double>(2U << level) <= style_->max_cell_pixels) {
    ++level;
  }
  return level;
}

void FaceChunk::_notifyCurrentCamera(Ogre::Camera* camera) {
  choosePart(levels_[levelFor(*camera)]);
  SimpleRenderable::_notifyCurrentCamera(camera);
}

const Ogre::MaterialPtr& FaceChunk::getMaterial() const {
  return is_coarse_ ? style_->coarse_material : style_->material;
}

Ogre::Real FaceChunk::getBoundingRadius() const { return kEdge * 1.7320508F; }

Ogre::Real FaceChunk::getSquaredViewDepth(const Ogre::Camera* camera) const {
  return node_->getSquaredViewDepth(camera);
}

}  // namespace cuboid_mapping_rviz
