// SPDX-License-Identifier: BSD-3-Clause
#include "face_scene.h"

#include "cuboid_mapping/parallel/parallel_for.h"

#include <algorithm>
#include <thread>

namespace cuboid_mapping_rviz {

using namespace cuboid_mapping;

void FaceScene::setShown(FaceSet set, bool is_shown) {
  Layer& shown = layer(set);
  if (shown.is_shown == is_shown) return;
  shown.is_shown = is_shown;
  makeAnew(set);
}

void FaceScene::makeAnew(FaceSet set) {
  Layer& shown = layer(set);
  shown.chunks.clear();
  shown.waiting.clear();
  shown.is_waiting.clear();
  enqueueAll(set);
}

void FaceScene::setJoined(bool are_joined) {
  if (are_joined == are_joined_) return;
  are_joined_ = are_joined;
  for (const FaceSet set : kFaceSets) makeAnew(set);
}

void FaceScene::setSliceLayer(std::int32_t layer) {
  if (layer == slice_layer_) return;
  slice_layer_ = layer;
  for (const FaceSet set : {FaceSet::kOccupiedSlice, FaceSet::kFreeSlice}) enqueueAll(set);
}

/// Enqueues all chunks, also shown ones, so that chunks without bricks are removed.
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
                           [&](const VoxelBrick& brick) { all.enqueue(chunkOf(brick.brick)); });
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
      layer.enqueue(chunkOf(brick));
      for (int axis = 0; axis < 3; ++axis) {  // Faces of neighbours towards the chunk may change.
        for (const std::int32_t step : {-kBrickEdge, kBrickEdge}) {
          Cell neighbour = brick;
          neighbour[axis] += step;
          layer.enqueue(chunkOf(neighbour));
        }
      }
    }
  }
}

void FaceScene::setStyle(FaceSet set, const FaceStyle& style) {
  Layer& shown = layer(set);
  shown.material.setStyle(style);
  FaceStyle coarse_style = style;
  coarse_style.is_coarse = true;
  shown.coarse_material.setStyle(coarse_style);
  shown.style.is_opaque = !isTransparent(style);
  shown.style.has_two_sides = hasTwoSides(style);
  // Coarse faces have no cuboid and no time of change.
  shown.style.has_coarse = (style.mode == ColorMode::kHeight || style.mode == ColorMode::kFlat) &&
                           style.oldest_s == FaceStyle().oldest_s;
}

void FaceScene::setMaxCellPixels(float max_cell_pixels) {
  for (Layer& layer : layers_) layer.style.max_cell_pixels = max_cell_pixels;
}

bool FaceScene::update(std::chrono::duration<double> budget) {
  using Clock = std::chrono::steady_clock;
  if (numWaiting() == 0) return false;
  const Clock::time_point end = Clock::now() + std::chrono::duration_cast<Clock::duration>(budget);
  source_.read([&](const CuboidMap& map) {
    for (const FaceSet set : kFaceSets) {
      while (!layer(set).waiting.empty() && Clock::now() < end) makeNext(map, set);
    }
  });
  return true;
}

/// Makes some chunks: a few for each thread, some milliseconds of work.
void FaceScene::makeNext(const CuboidMap& map, FaceSet set) {
  constexpr std::size_t kChunksOfThread = 4;
  Layer& shown = layer(set);
  const std::size_t num_threads = std::max(1U, std::thread::hardware_concurrency());
  const std::size_t count = std::min(shown.waiting.size(), kChunksOfThread * num_threads);
  const std::vector<Cell> names(shown.waiting.begin(),
                                shown.waiting.begin() + static_cast<std::ptrdiff_t>(count));
  shown.waiting.erase(shown.waiting.begin(),
                      shown.waiting.begin() + static_cast<std::ptrdiff_t>(count));
  std::vector<FaceMesh> meshes(count);
  const ChangeTimeOf changed_s = [this](const Cell& brick) {
    const auto found = changed_s_.find(brick);
    return found == changed_s_.end() ? kNever_s : found->second;
  };
  parallelFor(count, static_cast<int>(num_threads), [&](std::size_t i) {
    meshes[i] = makeFaces(map, {names[i], set, slice_layer_, are_joined_}, changed_s);
  });
  for (std::size_t i = 0; i < count; ++i) {
    shown.is_waiting.erase(names[i]);
    show(set, {names[i], map.grid().resolution()}, meshes[i]);
  }
}

void FaceScene::show(FaceSet set, const FaceChunk::Place& place, const FaceMesh& mesh) {
  Layer& shown = layer(set);
  if (mesh.numFaces() == 0) {
    shown.chunks.erase(place.chunk);
    return;
  }
  Chunk& chunk = shown.chunks[place.chunk];
  if (chunk.faces == nullptr) {
    chunk.faces = std::make_unique<FaceChunk>(node_, place, shown.style);
    chunk.picker =
        std::make_unique<CuboidPicker>(context_, source_, node_, place.chunk, *chunk.faces);
    chunk.picker->setJoined(are_joined_);
  }
  num_uploaded_bytes_ += chunk.faces->upload(mesh, indices_);
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
