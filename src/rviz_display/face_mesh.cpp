// SPDX-License-Identifier: BSD-3-Clause
#include "face_mesh.h"

#include "coarse_faces.h"

#include "cuboid_mapping/fusion/brick_division.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

namespace cuboid_mapping_rviz {
namespace {

using namespace cuboid_mapping;

/// The voxels that hide a side which they cover.
BrickMask hidingVoxels(const PackedVoxels& voxels, FaceSet set) {
  switch (set) {
    case FaceSet::kOccupied: return voxels.occupied();
    case FaceSet::kFree: return voxels.free();
    default: return voxels.known();
  }
}

/// The voxels next to a side of a box, outside of it.
CellBox layerAt(const CellBox& box, int side) {
  const int axis = side / 2;
  CellBox layer = box;
  layer.min[axis] = side % 2 == 0 ? box.min[axis] - 1 : box.max[axis];
  layer.max[axis] = layer.min[axis] + 1;
  return layer;
}

/// The corners of a side, counter-clockwise as seen from outside; bit i: upper end of axis i.
/// A cross section has those of its lower side, in the order of the upper one.
constexpr std::array<std::array<int, 4>, 7> kCorners{{{0, 4, 6, 2},
                                                      {1, 3, 7, 5},
                                                      {0, 1, 5, 4},
                                                      {2, 6, 7, 3},
                                                      {0, 2, 3, 1},
                                                      {4, 5, 7, 6},
                                                      {0, 1, 3, 2}}};

/// The class of whose cuboids a set shows faces.
Occupancy classOf(FaceSet set) {
  const bool is_occupied = set == FaceSet::kOccupied || set == FaceSet::kOccupiedSlice;
  return is_occupied ? Occupancy::kOccupied : Occupancy::kFree;
}

std::uint8_t toByte(double ratio) { return static_cast<std::uint8_t>(std::lround(255.0 * ratio)); }

/// Makes the faces of one chunk.
class FaceMaker {
 public:
  FaceMaker(const CuboidMap& map, const WantedFaces& wanted)
      : map_(map), chunk_(wanted.chunk), set_(wanted.set), slice_layer_(wanted.slice_layer) {}

  void add(const VoxelBrick& brick, float changed_s) {
    hiding_ = hidingVoxels(brick.voxels, set_);
    hiding_beside_.fill(std::nullopt);
    changed_s_ = changed_s;
    const Occupancy wanted = classOf(set_);
    cuboids_.clear();
    divideVoxels(brick.brick,
                 wanted == Occupancy::kOccupied ? brick.voxels.occupied() : brick.voxels.free(),
                 wanted, cuboids_);
    for (const Cuboid& cuboid : cuboids_) {
      if (isSlice(set_)) {
        addCrossSection(brick, cuboid.box);
      } else {
        addCuboid(brick, cuboid.box);
      }
    }
  }
  FaceMesh take() {
    mesh_.levels.fill({0, mesh_.vertices.size() / 4, false});
    if (set_ == FaceSet::kOccupied || set_ == FaceSet::kFree) addCoarseFaces();
    return std::move(mesh_);
  }

 private:
  /// What a FaceVertex says of its cuboid.
  struct Look {
    std::uint8_t probability;
    std::uint8_t size;
  };

  void addCuboid(const VoxelBrick& brick, const CellBox& box) {
    ++mesh_.num_cuboids;
    std::optional<Look> look;  // Wanted of those only that are seen.
    for (int side = 0; side < 6; ++side) {
      if (isHidden(brick.brick, box, side)) continue;
      if (!look) look = lookOf(brick.voxels, box);
      addFace(box, side, *look);
    }
  }

  void addCrossSection(const VoxelBrick& brick, const CellBox& box) {
    if (slice_layer_ < box.min.z || slice_layer_ >= box.max.z) return;
    ++mesh_.num_cuboids;
    CellBox section = box;
    section.min.z = slice_layer_;
    addFace(section, kSliceSide, lookOf(brick.voxels, box));
  }

  [[nodiscard]] bool isHidden(const Cell& brick, const CellBox& box, int side) {
    const CellBox layer = layerAt(box, side);
    const Cell other = brickOf(layer.min);
    const BrickMask voxels = BrickMask::ofBox(layer);
    if (other == brick) return hiding_.contains(voxels);
    std::optional<BrickMask>& hiding = hiding_beside_[static_cast<std::size_t>(side)];
    if (!hiding) hiding = hidingVoxelsOf(other);
    return hiding->contains(voxels);
  }

  [[nodiscard]] BrickMask hidingVoxelsOf(const Cell& brick) const {
    const PackedVoxels* voxels = map_.voxels().find(brick);
    return voxels == nullptr ? BrickMask() : hidingVoxels(*voxels, set_);
  }

  void addCoarseFaces() {
    constexpr std::size_t kFewFaces = 16;  // Not worth it.
    if (mesh_.levels[0].count < kFewFaces) return;
    CoarseCells cells(chunk_, [&](const Cell& brick) { return hidingVoxelsOf(brick); });
    for (std::size_t level = 1; level < kNumDetailLevels; ++level) {
      if (level > 1) cells.coarsen();
      const FaceMesh::Part& finer = mesh_.levels[level - 1];
      const std::size_t first = mesh_.vertices.size() / 4;
      cells.appendFaces(mesh_.vertices);
      const std::size_t count = mesh_.vertices.size() / 4 - first;
      const bool is_worth_it = 2 * count <= finer.count;
      const bool has_room = 2 * (first + count) <= 3 * mesh_.levels[0].count;
      if (is_worth_it && has_room) {
        mesh_.levels[level] = {first, count, true};
      } else {
        mesh_.levels[level] = finer;
        mesh_.vertices.resize(4 * first);
      }
    }
  }

  static double meanProbability(const PackedVoxels& voxels, const CellBox& box) {
    const BrickMask part = BrickMask::ofBox(box);
    double sum = 0.0;
    voxels.forEachValue([&](float log_odds, const BrickMask& of_value) {
      sum += toProbability(log_odds) * (of_value & part).count();
    });
    return sum / part.count();
  }

  static Look lookOf(const PackedVoxels& voxels, const CellBox& cuboid) {
    const Cell edges = cuboid.size();
    return {toByte(meanProbability(voxels, cuboid)),
            toByte((edges.x + edges.y + edges.z) / (3.0 * kBrickEdge))};
  }

  void addFace(const CellBox& box, int side, const Look& look) {
    FaceVertex vertex{};
    vertex.probability = look.probability;
    vertex.size = look.size;
    vertex.changed_s = changed_s_;
    appendFace({box.min - chunk_, box.max - chunk_}, side, vertex, mesh_.vertices);
  }

  const CuboidMap& map_;
  const Cell chunk_;
  const FaceSet set_;
  const std::int32_t slice_layer_;
  BrickMask hiding_;                                       ///< Of the current brick.
  std::array<std::optional<BrickMask>, 6> hiding_beside_;  ///< Of the bricks beside it, by side.
  float changed_s_ = 0.0F;
  std::vector<Cuboid> cuboids_;
  FaceMesh mesh_;
};

}  // namespace

void appendFace(const CellBox& box, int side, FaceVertex vertex,
                std::vector<FaceVertex>& vertices) {
  const auto& corners = kCorners[static_cast<std::size_t>(side)];
  for (std::size_t i = 0; i < corners.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      const bool is_upper = (corners[i] >> axis & 1) != 0;
      vertex.cell[static_cast<std::size_t>(axis)] =
          static_cast<std::int16_t>(is_upper ? box.max[axis] : box.min[axis]);
    }
    vertex.code = static_cast<std::int16_t>(4 * side + static_cast<int>(i));
    vertices.push_back(vertex);
  }
}

FaceMesh makeFaces(const CuboidMap& map, const WantedFaces& wanted, const ChangeTimeOf& changed_s) {
  FaceMaker maker(map, wanted);
  CellBox box{wanted.chunk, wanted.chunk + Cell{kChunkEdge, kChunkEdge, kChunkEdge}};
  if (isSlice(wanted.set)) {
    box.min.z = std::max(box.min.z, wanted.slice_layer);
    box.max.z = std::min(box.max.z, wanted.slice_layer + 1);
    if (box.isEmpty()) return {};
  }
  map.voxels().forEachIn(
      box, [&](const VoxelBrick& brick) { maker.add(brick, changed_s(brick.brick)); });
  return maker.take();
}

}  // namespace cuboid_mapping_rviz
