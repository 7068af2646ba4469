// SPDX-License-Identifier: BSD-3-Clause
#include "face_chunk.h"

#include "face_material.h"

#include <OgreCamera.h>
#include <OgreHardwareBufferManager.h>
#include <OgreMaterialManager.h>
#include <OgreRenderQueue.h>
#include <OgreSceneManager.h>
#include <OgreSceneNode.h>
#include <OgreViewport.h>

#include <algorithm>
#include <cmath>

namespace cuboid_mapping_rviz {
namespace {

constexpr auto kEdge = static_cast<float>(kChunkEdge);
/// Last place in the draw order of chunks of opaque faces; everything else is drawn later.
constexpr double kLastOpaque = OGRE_RENDERABLE_DEFAULT_PRIORITY - 1;

void declareVertex(Ogre::VertexDeclaration& declaration) {
  declaration.addElement(0, offsetof(FaceVertex, cell), Ogre::VET_SHORT4, Ogre::VES_POSITION);
  declaration.addElement(0, offsetof(FaceVertex, probability), Ogre::VET_COLOUR_ABGR,
                         Ogre::VES_DIFFUSE);
  declaration.addElement(0, offsetof(FaceVertex, changed_s), Ogre::VET_FLOAT1,
                         Ogre::VES_TEXTURE_COORDINATES, 0);
}

Ogre::Vector3 toOgre(const cuboid_mapping::Cell& cell) {
  return {static_cast<float>(cell.x), static_cast<float>(cell.y), static_cast<float>(cell.z)};
}

double pixelsPerMetre(const Ogre::Camera& camera, double distance_m) {
  const double height_pixels = camera.getViewport()->getActualHeight();
  if (camera.getProjectionType() == Ogre::PT_ORTHOGRAPHIC) {
    return height_pixels / camera.getOrthoWindowHeight();
  }
  const double per_radian = height_pixels / (2.0 * std::tan(0.5 * camera.getFOVy().valueRadians()));
  return per_radian / std::max(distance_m, 1e-3);
}

}  // namespace

FaceChunk::FaceChunk(Ogre::SceneNode& node, const Place& place, const ChunkStyle& style)
    : node_(node.createChildSceneNode()),
      style_(&style),
      resolution_m_(place.resolution_m),
      vertex_data_(std::make_unique<Ogre::VertexData>()) {
  const auto resolution_m = static_cast<float>(place.resolution_m);
  const Ogre::Vector3 corner_map(static_cast<float>(place.chunk.x * place.resolution_m),
                                 static_cast<float>(place.chunk.y * place.resolution_m),
                                 static_cast<float>(place.chunk.z * place.resolution_m));
  node_->setPosition(corner_map);
  node_->setScale(resolution_m, resolution_m, resolution_m);
  declareVertex(*vertex_data_->vertexDeclaration);
  for (Run& run : runs_) {
    run.setCustomParameter(kChunkParameter,
                           {corner_map.x, corner_map.y, corner_map.z, resolution_m});
  }
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
  num_runs_ = 0;
  if (num_vertices_ == 0) {
    vertex_data_->vertexBufferBinding->unsetAllBindings();
    for (Run& run : runs_) run.indices.indexBuffer = {};
    return 0;
  }
  bounds_.setExtents(toOgre(mesh.bounds.min), toOgre(mesh.bounds.max));
  node_->needUpdate();  // Ogre keeps the bounds of nodes that do not move.
  if (!is_as_many) {
    vertex_data_->vertexBufferBinding->setBinding(
        0, Ogre::HardwareBufferManager::getSingleton().createVertexBuffer(
               sizeof(FaceVertex), num_vertices_, Ogre::HardwareBuffer::HBU_STATIC_WRITE_ONLY));
  }
  for (Run& run : runs_) run.indices.indexBuffer = indices.forFaces(numFaces());
  vertex_data_->vertexBufferBinding->getBuffer(0)->writeData(0, numBytes(), mesh.vertices.data(),
                                                             true);
  return numBytes();
}

std::size_t FaceChunk::levelFor(const Ogre::Camera& camera, double distance_m) const {
  if (!style_->has_coarse) return 0;
  const Ogre::Viewport* viewport = camera.getViewport();
  const bool is_picture = viewport != nullptr && viewport->getMaterialScheme() ==
                                                     Ogre::MaterialManager::DEFAULT_SCHEME_NAME;
  if (!is_picture) return 0;
  const double voxel_pixels = resolution_m_ * pixelsPerMetre(camera, distance_m);
  std::size_t level = 0;
  while (level + 1 < kNumDetailLevels &&
         voxel_pixels * static_cast<double>(2U << level) <= style_->max_cell_pixels) {
    ++level;
  }
  return level;
}

/// Draws from front to back: hidden pixels then need no shader. Ogre itself sorts only transparent faces by
/// depth.
std::uint16_t FaceChunk::drawOrderFor(double distance_m) const {
  if (!style_->is_opaque) return OGRE_RENDERABLE_DEFAULT_PRIORITY;
  const double num_chunks = distance_m / (kEdge * resolution_m_);
  return static_cast<std::uint16_t>(std::min(num_chunks, kLastOpaque));
}

FaceChunk::Sides FaceChunk::sidesFor(const Ogre::Camera& camera) const {
  Sides sides;
  sides.fill(true);
  if (style_->has_two_sides || camera.getProjectionType() == Ogre::PT_ORTHOGRAPHIC) return sides;
  const Ogre::Vector3 eye = node_->convertWorldToLocalPosition(camera.getDerivedPosition());
  for (std::size_t axis = 0; axis < 3; ++axis) {
    sides[2 * axis] = eye[axis] < bounds_.getMaximum()[axis];
    sides[2 * axis + 1] = eye[axis] > bounds_.getMinimum()[axis];
  }
  return sides;
}

void FaceChunk::choose(const FaceMesh::Part& part, const Sides& sides) {
  is_coarse_ = part.is_coarse;
  vertex_data_->vertexStart = 4 * part.first;
  vertex_data_->vertexCount = 4 * part.count();
  num_runs_ = 0;
  std::size_t begin = 0;
  for (std::size_t i = 0; i < kSideOrder.size(); ++i) {
    const bool is_seen = sides[static_cast<std::size_t>(kSideOrder[i])];
    if (is_seen && part.ends[i] > begin) addRun(begin, part.ends[i]);
    begin = part.ends[i];
  }
}

/// Extends the last run, or adds one after a gap.
void FaceChunk::addRun(std::size_t begin, std::size_t end) {
  constexpr std::size_t kIndicesOfFace = 6;
  const std::size_t first = kIndicesOfFace * begin;
  if (num_runs_ > 0) {
    Ogre::IndexData& last = runs_[num_runs_ - 1].indices;
    if (last.indexStart + last.indexCount == first) {
      last.indexCount = kIndicesOfFace * end - last.indexStart;
      return;
    }
  }
  Ogre::IndexData& indices = runs_[num_runs_++].indices;
  indices.indexStart = first;
  indices.indexCount = kIndicesOfFace * end - first;
}

void FaceChunk::_notifyCurrentCamera(Ogre::Camera* camera) {
  // Distance to the nearest point of the faces.
  const double distance_m = node_->_getWorldAABB().distance(camera->getDerivedPosition());
  choose(levels_[levelFor(*camera, distance_m)], sidesFor(*camera));
  draw_order_ = drawOrderFor(distance_m);
  MovableObject::_notifyCurrentCamera(camera);
}

void FaceChunk::_updateRenderQueue(Ogre::RenderQueue* queue) {
  for (std::size_t i = 0; i < num_runs_; ++i) {
    queue->addRenderable(&runs_[i], mRenderQueueID, draw_order_);
  }
}

void FaceChunk::visitRenderables(Ogre::Renderable::Visitor* visitor, bool /*is_debug*/) {
  for (Run& run : runs_) visitor->visit(&run, 0, false);
}

const Ogre::String& FaceChunk::getMovableType() const {
  static const Ogre::String kType = "FaceChunk";
  return kType;
}

Ogre::Real FaceChunk::getBoundingRadius() const { return kEdge * 1.7320508F; }

const Ogre::MaterialPtr& FaceChunk::Run::getMaterial() const {
  return chunk_->is_coarse_ ? chunk_->style_->coarse_material : chunk_->style_->material;
}

void FaceChunk::Run::getRenderOperation(Ogre::RenderOperation& operation) {
  operation.operationType = Ogre::RenderOperation::OT_TRIANGLE_LIST;
  operation.useIndexes = true;
  operation.vertexData = chunk_->vertex_data_.get();
  operation.indexData = &indices;
}

void FaceChunk::Run::getWorldTransforms(Ogre::Matrix4* transform) const {
  *transform = chunk_->_getParentNodeFullTransform();
}

Ogre::Real FaceChunk::Run::getSquaredViewDepth(const Ogre::Camera* camera) const {
  return chunk_->node_->getSquaredViewDepth(camera);
}

}  // namespace cuboid_mapping_rviz
