// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_picker.h"
#include "face_chunk.h"
#include "face_material.h"
#include "map_source.h"

#include <array>
#include <chrono>
#include <deque>
#include <limits>
#include <unordered_map>
#include <unordered_set>

namespace cuboid_mapping_rviz {

/// The picture of a map: chunks of faces, made anew where the map has changed.
///
/// Thread rule: that of rviz, all calls in its main thread.
class FaceScene {
 public:
  struct Counts {
    std::size_t cuboids = 0;
    std::size_t faces = 0;
    std::size_t chunks = 0;
    std::size_t bytes = 0;  ///< On the graphics card.
  };

  /// @param node  In the map frame. It and the source must outlive this object.
  FaceScene(rviz::DisplayContext* context, Ogre::SceneNode& node, const MapSource& source)
      : context_(context), node_(node), source_(source) {}

  /// What is not shown takes no memory, and is made when it is shown again.
  void setShown(FaceSet set, bool is_shown);
  [[nodiscard]] bool isShown(FaceSet set) const { return layer(set).is_shown; }
  /// Of the voxels that slices cut, in cells. What was made of another one goes bit by bit.
  void setSliceLayer(std::int32_t layer);
  /// Whether cuboids are joined across bricks, chunk by chunk. All is made anew.
  void setJoined(bool are_joined);
  /// Changes no vertex.
  void setStyle(FaceSet set, const FaceStyle& style);
  /// Coarse faces are drawn whose cells take so many pixels at most, where the style allows it; 0: none are.
  void setMaxCellPixels(float max_cell_pixels);

  /// @param now_s  In the display's time, for FaceStyle::oldest_s. A map that is new as a whole has not changed.
  void noteChanges(const cuboid_mapping::ChangeSet& changes, float now_s);
  /// Brings the picture up to date, for about so long at most.
  /// @return Whether something was made.
  bool update(std::chrono::duration<double> budget);

  [[nodiscard]] Counts counts(FaceSet set) const;
  /// Chunks that wait for update().
  [[nodiscard]] std::size_t numWaiting() const;
  /// Sent to the graphics card so far.
  [[nodiscard]] std::uint64_t numUploadedBytes() const { return num_uploaded_bytes_; }

 private:
  struct Chunk {
    std::unique_ptr<FaceChunk> faces;
    std::unique_ptr<CuboidPicker> picker;  ///< Goes first.
  };
  template <typename ValueT>
  using ByCell = std::unordered_map<cuboid_mapping::Cell, ValueT, cuboid_mapping::CellHash>;

  /// What is shown of one set.
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
  ByCell<float> changed_s_;  ///< By brick, since the whole map came.
};

}  // namespace cuboid_mapping_rviz
