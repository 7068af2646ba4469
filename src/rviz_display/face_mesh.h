// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

namespace cuboid_mapping_rviz {

/// Sets of faces that are drawn.
enum class FaceSet : unsigned char {
  kOccupied,       ///< Sides of occupied cuboids that occupied voxels do not cover.
  kFree,           ///< Sides of free cuboids that free voxels do not cover.
  kFrontier,       ///< Sides of free cuboids that touch an unknown voxel.
  kOccupiedSlice,  ///< Cross sections of occupied cuboids at one height.
  kFreeSlice,      ///< Cross sections of free cuboids at one height.
};
constexpr std::array<FaceSet, 5> kFaceSets{FaceSet::kOccupied, FaceSet::kFree, FaceSet::kFrontier,
                                           FaceSet::kOccupiedSlice, FaceSet::kFreeSlice};

[[nodiscard]] constexpr bool isSlice(FaceSet set) { return set >= FaceSet::kOccupiedSlice; }

/// Side of a FaceVertex for a cross section, which the shader draws at the height of the slice.
constexpr std::int16_t kSliceSide = 6;

/// Order of the faces of a chunk by their sides: in views from above, faces towards the camera are mostly next
/// to each other.
constexpr std::array<int, 7> kSideOrder{4, 0, 2, 5, 1, 3, kSliceSide};

/// Time of change of bricks that have not changed since the whole map came.
constexpr float kNever_s = -1e30F;

/// A corner of a face, in the format of the graphics card.
struct FaceVertex {
  std::array<std::int16_t, 3> cell;  ///< Place in cells, relative to the chunk.
  std::int16_t code;  ///< 4 * side + corner; side: 2 * axis + (1 for the upper one), or kSliceSide.
  std::uint8_t probability;  ///< Mean of the cuboid's voxels, times 255.
  /// Sum of the edges of the cuboid, 3 to 24, times 255 / 24; for coarse faces see CoarseCells.
  std::uint8_t size;
  std::array<std::uint8_t, 2> padding;
  float changed_s;  ///< Last change of the brick, in the display's time, or kNever_s.
};
static_assert(sizeof(FaceVertex) == 16);

/// A chunk is an aligned cube of voxels of this edge, named by its least cell.
constexpr std::int32_t kChunkEdge = 64;

/// The chunk that a cell lies in.
[[nodiscard]] constexpr cuboid_mapping::Cell chunkOf(const cuboid_mapping::Cell& cell) {
  return {cell.x & ~(kChunkEdge - 1), cell.y & ~(kChunkEdge - 1), cell.z & ~(kChunkEdge - 1)};
}

/// Number of levels of detail. Level 0 has the cuboids; level n has cells with edges of 2^n voxels, for distant
/// chunks.
constexpr std::size_t kNumDetailLevels = 4;

/// The faces of one chunk: four vertices each.
struct FaceMesh {
  /// Some of the faces.
  struct Part {
    std::size_t first = 0;
    /// End of the faces of each side in kSideOrder, counted from the first face.
    std::array<std::size_t, kSideOrder.size()> ends{};
    bool is_coarse = false;

    [[nodiscard]] std::size_t count() const { return ends.back(); }
  };

  std::vector<FaceVertex> vertices;
  /// The faces of each level; a level that would save too little repeats the finer one.
  std::array<Part, kNumDetailLevels> levels;
  /// Number of cuboids of the class, with hidden ones; of a slice only those that it cuts.
  std::size_t num_cuboids = 0;
  /// Bounds of the faces of all levels, in cells relative to the chunk.
  cuboid_mapping::CellBox bounds;

  /// Number of faces of cuboids.
  [[nodiscard]] std::size_t numFaces() const { return levels[0].count(); }
};

/// Appends a side of a box. @param box  In cells, relative to the chunk. @param vertex  All members except cell
/// and code.
void appendFace(const cuboid_mapping::CellBox& box, int side, FaceVertex vertex,
                std::vector<FaceVertex>& vertices);

/// Time of the last change of a brick.
using ChangeTimeOf = std::function<float(const cuboid_mapping::Cell& brick)>;

/// Request of makeFaces().
struct WantedFaces {
  cuboid_mapping::Cell chunk;
  FaceSet set = FaceSet::kOccupied;
  std::int32_t slice_layer = 0;  ///< Height of the voxels that a slice cuts, in cells.
  /// Cuboids are joined across the bricks of the chunk, see joinCuboids(); they end at the faces of the chunk.
  bool are_joined = false;
};

/// The exposed faces of a chunk: for each side of a cuboid the smallest rectangle around its uncovered part.
/// For a slice: the cross sections of all cuboids in a layer of voxels. The frontier and slices have no coarse
/// faces. The faces of a joined cuboid have the time of its latest change. @complexity O(cuboids of the chunk).
[[nodiscard]] FaceMesh makeFaces(const cuboid_mapping::CuboidMap& map, const WantedFaces& wanted,
                                 const ChangeTimeOf& changed_s);

}  // namespace cuboid_mapping_rviz
