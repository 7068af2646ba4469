// SPDX-License-Identifier: BSD-3-Clause
#include "face_mesh.h"

#include "cuboid_mapping/fusion/brick_division.h"

#include <cmath>

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
constexpr std::array<std::array<int, 4>, 6> kCorners{
    {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}}};

std::uint8_t toByte(double ratio) { return static_cast<std::uint8_t>(std::lround(255.0 * ratio)); }

/// Makes the faces of one group.
class FaceMaker {
 public:
  FaceMaker(const CuboidMap& map, const Cell& group, FaceSet set)
      : map_(map), group_(group), set_(set) {}

  void add(const VoxelBrick& brick, float changed_s) {
    hiding_ = hidingVoxels(brick.voxels, set_);
    changed_s_ = changed_s;
    const bool is_occupied = set_ == FaceSet::kOccupied;
    cuboids_.clear();
    divideVoxels(brick.brick, is_occupied ? brick.voxels.occupied() : brick.voxels.free(),
                 is_occupied ? Occupancy::kOccupied : Occupancy::kFree, cuboids_);
    for (const Cuboid& cuboid : cuboids_) addCuboid(brick, cuboid.box);
  }
  FaceMesh take() { return std::move(mesh_); }

 private:
  void addCuboid(const VoxelBrick& brick, const CellBox& box) {
    ++mesh_.num_cuboids;
    std::optional<std::uint8_t> probability;  // Wanted of those only that are seen.
    for (int side = 0; side < 6; ++side) {
      if (isHidden(brick.brick, layerAt(box, side))) continue;
      if (!probability) probability = toByte(meanProbability(brick.voxels, box));
      addFace(box, side, *probability);
    }
  }

  [[nodiscard]] bool isHidden(const Cell& brick, const CellBox& layer) const {
    const Cell other = brickOf(layer.min);
    const BrickMask voxels = BrickMask::ofBox(layer);
    if (other == brick) return hiding_.contains(voxels);
    const PackedVoxels* neighbour = map_.voxels().find(other);
    return neighbour != nullptr && hidingVoxels(*neighbour, set_).contains(voxels);
  }

  static double meanProbability(const PackedVoxels& voxels, const CellBox& box) {
    const BrickMask part = BrickMask::ofBox(box);
    double sum = 0.0;
    voxels.forEachValue([&](float log_odds, const BrickMask& of_value) {
      sum += toProbability(log_odds) * (of_value & part).count();
    });
    return sum / part.count();
  }

  void addFace(const CellBox& box, int side, std::uint8_t probability) {
    const Cell edges = box.max - box.min;
    const auto& corners = kCorners[static_cast<std::size_t>(side)];
    for (int i = 0; i < 4; ++i) {
      FaceVertex vertex{};
      for (int axis = 0; axis < 3; ++axis) {
        const bool is_upper = (corners[static_cast<std::size_t>(i)] >> axis & 1) != 0;
        vertex.cell[static_cast<std::size_t>(axis)] =
            static_cast<std::int16_t>((is_upper ? box.max[axis] : box.min[axis]) - group_[axis]);
      }
      vertex.code = static_cast<std::int16_t>(4 * side + i);
      vertex.probability = probability;
      vertex.size = toByte((edges.x + edges.y + edges.z) / (3.0 * kBrickEdge));
      vertex.changed_s = changed_s_;
      mesh_.vertices.push_back(vertex);
    }
  }

  const CuboidMap& map_;
  const Cell group_;
  const FaceSet set_;
  BrickMask hiding_;  ///< Of the current brick.
  float changed_s_ = 0.0F;
  std::vector<Cuboid> cuboids_;
  FaceMesh mesh_;
};

}  // namespace

FaceMesh makeFaces(const CuboidMap& map, const Cell& group, FaceSet set,
                   const ChangeTimeOf& changed_s) {
  FaceMaker maker(map, group, set);
  const CellBox box{group, group + Cell{kGroupEdge, kGroupEdge, kGroupEdge}};
  map.voxels().forEachIn(
      box, [&](const VoxelBrick& brick) { maker.add(brick, changed_s(brick.brick)); });
  return maker.take();
}

}  // namespace cuboid_mapping_rviz
