// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_picker.h"
#include "face_chunk.h"
#include "face_material.h"
#include "map_source.h"

#include <array>
#include <chrono>
#include <deque>
#include <unordered_map>
#include <unordered_set>

namespace cuboid_mapping_rviz {

/// The picture of a map: chunks of faces, which are rebuilt when the map changes.
///
/// Thread rule: that of rviz, all calls in its main thread.
class FaceScene {
 public:
  struct Counts {
    std::size_t cuboids = 0;
    std::size_t faces = 0;
    std::size_t chunks = 0;
    std::size_t bytes = 0;  ///< Memory on the graphics card.
  };

  /// @param node  Node in the map frame. It and the source must outlive this object.
  FaceScene(rviz::DisplayContext* context, Ogre::SceneNode& node, const MapSource& source)
      : context_(context), node_(node), source_(source) {}

  /// Shows or hides a set. Hidden sets take no memory, and are rebuilt when they are shown again.
  void setShown(FaceSet set, bool is_shown);
  [[nodiscard]] bool isShown(FaceSet set) const { return layer(set).is_shown; }
  /// Sets the layer of voxels of slices, in cells. Chunks of another layer are replaced one by one.
  void setSliceLayer(std::int32_t layer);
  /// Sets whether cuboids are joined across the bricks of a chunk; a change rebuilds all chunks.
  void setJoined(bool are_joined);
  /// Sets the style of a set; vertices stay as they are.
  void setStyle(FaceSet set, const FaceStyle& style);
  /// Draws coarse faces whose cells take at most this many pixels, if the style allows it; 0: none.
  void setMaxCellPixels(float max_cell_pixels);

  /// Notes changes of the map. @param now_s  Time of the display, for FaceStyle::oldest_s. A whole new map
  /// counts as unchanged.
  void noteChanges(const cuboid_mapping::ChangeSet& changes, float now_s);
  /// Updates the picture, for about this time at most. @return Whether it has changed.
  bool update(std::chrono::duration<double> budget);

  [[nodiscard]] Counts counts(FaceSet set) const;
  /// Number of chunks that wait for update().
  [[nodiscard]] std::size_t numWaiting() const;
  /// Number of bytes sent to the graphics card so far.
  [[nodiscard]] std::uint64_t numUploadedBytes() const { return num_uploaded_bytes_; }

 private:
  struct Chunk {
    std::unique_ptr<FaceChunk> faces;
    std::unique_ptr<CuboidPicker> picker;  ///< Destroyed first.
  };
  template <typename ValueT>
  using ByCell = std::unordered_map<cuboid_mapping::Cell, ValueT, cuboid_mapping::CellHash>;

  /// The picture of one set.
  struct Layer {
    bool is_shown = false;
    FaceMaterial material;
    FaceMaterial coarse_material;
    ChunkStyle style{material.get(), coarse_material.get()};
    ByCell<Chunk> chunks;
    std::deque<cuboid_mapping::Cell> waiting;  ///< Chunks, each once.
    std::unordered_set<cuboid_mapping::Cell, cuboid_mapping::CellHash> is_waiting;

    void enqueue(const cuboid_mapping::Cell& chunk) {
      if (is_shown && is_waiting.insert(chunk).second) waiting.push_back(chunk);
    }
  };

  [[nodiscard]] Layer& layer(FaceSet set) { return layers_[static_cast<std::size_t>(set)]; }
  [[nodiscard]] const Layer& layer(FaceSet set) const {
    return layers_[static_cast<std::size_t>(set)];
  }
  void enqueueAll(FaceSet set);
  void makeAnew(FaceSet set);
  void makeNext(const cuboid_mapping::CuboidMap& map, FaceSet set);
  void show(FaceSet set, const FaceChunk::Place& place, const FaceMesh& mesh);

  rviz::DisplayContext* context_;
  Ogre::SceneNode& node_;
  const MapSource& source_;
  std::array<Layer, kFaceSets.size()> layers_;
  FaceIndices indices_;
  std::int32_t slice_layer_ = 0;
  bool are_joined_ = false;
  std::uint64_t num_uploaded_bytes_ = 0;
  ByCell<float> changed_s_;  ///< Time of change by brick, since the whole map came.
};

}  // namespace cuboid_mapping_rviz
