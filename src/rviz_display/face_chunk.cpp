// SPDX-License-Identifier: BSD-3-Clause
#include "face_chunk.h"

#include "face_material.h"

#include <OgreCamera.h>
#include <OgreHardwareBufferManager.h>
#include <OgreSceneManager.h>
#include <OgreSceneNode.h>

#include <algorithm>

namespace cuboid_mapping_rviz {
namespace {

constexpr auto kChunkEdge = static_cast<float>(cuboid_mapping::kGroupEdge);

void declareVertex(Ogre::VertexDeclaration& declaration) {
  declaration.addElement(0, offsetof(FaceVertex, cell), Ogre::VET_SHORT4, Ogre::VES_POSITION);
  declaration.addElement(0, offsetof(FaceVertex, probability), Ogre::VET_COLOUR_ABGR,
                         Ogre::VES_DIFFUSE);
  declaration.addElement(0, offsetof(FaceVertex, changed_s), Ogre::VET_FLOAT1,
                         Ogre::VES_TEXTURE_COORDINATES, 0);
}

/// Two triangles for each four vertices.
template <typename IndexT>
void writeIndices(std::size_t num_faces, void* memory) {
  auto* index = static_cast<IndexT*>(memory);
  for (std::size_t face = 0; face < num_faces; ++face) {
    for (const std::size_t corner : {0, 1, 2, 0, 2, 3}) {
      *index++ = static_cast<IndexT>(4 * face + corner);
    }
  }
}

}  // namespace

FaceChunk::FaceChunk(Ogre::SceneNode& node, const Place& place, const Ogre::MaterialPtr& material)
    : node_(node.createChildSceneNode()),
      vertex_data_(std::make_unique<Ogre::VertexData>()),
      index_data_(std::make_unique<Ogre::IndexData>()) {
  const auto resolution_m = static_cast<float>(place.resolution_m);
  const Ogre::Vector3 corner_map(static_cast<float>(place.group.x * place.resolution_m),
                                 static_cast<float>(place.group.y * place.resolution_m),
                                 static_cast<float>(place.group.z * place.resolution_m));
  node_->setPosition(corner_map);
  node_->setScale(resolution_m, resolution_m, resolution_m);
  declareVertex(*vertex_data_->vertexDeclaration);
  mRenderOp.operationType = Ogre::RenderOperation::OT_TRIANGLE_LIST;
  mRenderOp.useIndexes = true;
  mRenderOp.vertexData = vertex_data_.get();
  mRenderOp.indexData = index_data_.get();
  setMaterial(material);
  setCustomParameter(kGroupParameter, {corner_map.x, corner_map.y, corner_map.z, resolution_m});
  setBoundingBox({Ogre::Vector3::ZERO, Ogre::Vector3(kChunkEdge)});
  node_->attachObject(this);
}

FaceChunk::~FaceChunk() {
  node_->detachAllObjects();
  node_->getCreator()->destroySceneNode(node_);
}

std::size_t FaceChunk::upload(const FaceMesh& mesh) {
  num_cuboids_ = mesh.num_cuboids;
  const bool is_as_many = mesh.numFaces() == num_faces_;
  num_faces_ = mesh.numFaces();
  setVisible(num_faces_ > 0);
  if (num_faces_ == 0) {
    vertex_data_->vertexBufferBinding->unsetAllBindings();
    index_data_->indexBuffer.reset();
    return 0;
  }
  const std::size_t bytes = mesh.vertices.size() * sizeof(FaceVertex);
  if (!is_as_many) {
    vertex_data_->vertexBufferBinding->setBinding(
        0,
        Ogre::HardwareBufferManager::getSingleton().createVertexBuffer(
            sizeof(FaceVertex), mesh.vertices.size(), Ogre::HardwareBuffer::HBU_STATIC_WRITE_ONLY));
    uploadIndices();
  }
  vertex_data_->vertexStart = 0;
  vertex_data_->vertexCount = mesh.vertices.size();
  vertex_data_->vertexBufferBinding->getBuffer(0)->writeData(0, bytes, mesh.vertices.data(), true);
  return bytes + (is_as_many ? 0 : index_data_->indexBuffer->getSizeInBytes());
}

void FaceChunk::uploadIndices() {
  constexpr std::size_t kMostOf16Bits = 65536 / 4;
  const bool is_short = num_faces_ <= kMostOf16Bits;
  const auto type =
      is_short ? Ogre::HardwareIndexBuffer::IT_16BIT : Ogre::HardwareIndexBuffer::IT_32BIT;
  index_data_->indexBuffer = Ogre::HardwareBufferManager::getSingleton().createIndexBuffer(
      type, 6 * num_faces_, Ogre::HardwareBuffer::HBU_STATIC_WRITE_ONLY);
  index_data_->indexStart = 0;
  index_data_->indexCount = 6 * num_faces_;
  void* memory = index_data_->indexBuffer->lock(Ogre::HardwareBuffer::HBL_DISCARD);
  if (is_short) {
    writeIndices<std::uint16_t>(num_faces_, memory);
  } else {
    writeIndices<std::uint32_t>(num_faces_, memory);
  }
  index_data_->indexBuffer->unlock();
}

std::size_t FaceChunk::numBytes() const {
  if (num_faces_ == 0) return 0;
  return 4 * num_faces_ * sizeof(FaceVertex) + index_data_->indexBuffer->getSizeInBytes();
}

Ogre::Real FaceChunk::getBoundingRadius() const { return kChunkEdge * 1.7320508F; }

Ogre::Real FaceChunk::getSquaredViewDepth(const Ogre::Camera* camera) const {
  return node_->getSquaredViewDepth(camera);
}

}  // namespace cuboid_mapping_rviz
