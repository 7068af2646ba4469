// SPDX-License-Identifier: BSD-3-Clause
#include "face_scene.h"

namespace cuboid_mapping_rviz {

using namespace cuboid_mapping;

void FaceScene::setShown(FaceSet set, bool is_shown) {
  Layer& shown = layer(set);
  if (shown.is_shown == is_shown) return;
  shown.is_shown = is_shown;
  shown.chunks.clear();
  shown.waiting.clear();
  shown.is_waiting.clear();
  if (is_shown) enqueueAll(set);
}

void FaceScene::setSliceLayer(std::int32_t layer) {
  if (layer == slice_layer_) return;
  slice_layer_ = layer;
  for (const FaceSet set : {FaceSet::kOccupiedSlice, FaceSet::kFreeSlice}) enqueueAll(set);
}

/// Also the groups of chunks, so that those go whose bricks are gone.
void FaceScene::enqueueAll(FaceSet set) {
  Layer& all = layer(set);
  if (!all.is_shown) return;
  for (const auto& item : all.chunks) all.enqueue(item.first);
  CellBox box = kAllCells;
  if (isSlice(set)) {
    box.min.z = slice_layer_;
    box.max.z = slice_layer_ + 1;
  }
  source_.read([&](const CuboidMap& map) {
    map.voxels().forEachIn(box,
                           [&](const VoxelBrick& brick) { all.enqueue(groupOf(brick.brick)); });
  });
}

void FaceScene::noteChanges(const ChangeSet& changes, float now_s) {
  if (changes.is_everything) {
    changed_s_.clear();
    for (const FaceSet set : kFaceSets) enqueueAll(set);
    return;
  }
  for (const ChangedBrick& changed : changes.bricks) {
    const Cell& brick = changed.brick;
    changed_s_[brick] = now_s;
    for (Layer& layer : layers_) {
      layer.enqueue(groupOf(brick));
      for (int axis = 0; axis < 3; ++axis) {  // Neighbours show other faces towards it.
        for (const std::int32_t step : {-kBrickEdge, kBrickEdge}) {
          Cell neighbour = brick;
          neighbour[axis] += step;
          layer.enqueue(groupOf(neighbour));
        }
      }
    }
  }
}

bool FaceScene::update(std::chrono::duration<double> budget) {
  using Clock = std::chrono::steady_clock;
  if (numWaiting() == 0) return false;
  const Clock::time_point end = Clock::now() + std::chrono::duration_cast<Clock::duration>(budget);
  source_.read([&](const CuboidMap& map) {
    for (const FaceSet set : kFaceSets) {
      Layer& shown = layer(set);
      while (!shown.waiting.empty() && Clock::now() < end) {
        const Cell group = shown.waiting.front();
        shown.waiting.pop_front();
        shown.is_waiting.erase(group);
        make(map, set, group);
      }
    }
  });
  return true;
}

void FaceScene::make(const CuboidMap& map, FaceSet set, const Cell& group) {
  Layer& shown = layer(set);
  const FaceMesh mesh = makeFaces(map, {group, set, slice_layer_}, [this](const Cell& brick) {
    const auto found = changed_s_.find(brick);
    return found == changed_s_.end() ? kNever_s : found->second;
  });
  if (mesh.numFaces() == 0) {
    shown.chunks.erase(group);
    return;
  }
  Chunk& chunk = shown.chunks[group];
  if (chunk.faces == nullptr) {
    const FaceChunk::Place place{group, map.grid().resolution()};
    chunk.faces = std::make_unique<FaceChunk>(node_, place, shown.material.get());
    chunk.picker = std::make_unique<CuboidPicker>(context_, source_, node_, group, *chunk.faces);
  }
  num_uploaded_bytes_ += chunk.faces->upload(mesh);
}

FaceScene::Counts FaceScene::counts(FaceSet set) const {
  Counts counts;
  for (const auto& item : layer(set).chunks) {
    const FaceChunk& faces = *item.second.faces;
    ++counts.chunks;
    counts.cuboids += faces.numCuboids();
    counts.faces += faces.numFaces();
    counts.bytes += faces.numBytes();
  }
  return counts;
}

std::size_t FaceScene::numWaiting() const {
  std::size_t count = 0;
  for (const Layer& layer : layers_) count += layer.waiting.size();
  return count;
}

}  // namespace cuboid_mapping_rviz
