// SPDX-License-Identifier: BSD-3-Clause
#include "face_mesh.h"

#include "coarse_faces.h"

#include "cuboid_mapping/boxes/joined_cuboids.h"
#include "cuboid_mapping/query/value_query.h"
#include "cuboid_mapping/voxels/brick_cuboids.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

namespace cuboid_mapping_rviz {
namespace {

using namespace cuboid_mapping;

/// The voxels that hide the sides that they cover.
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

/// The smallest box around voxels of a brick. @pre There are some.
CellBox boxAround(const Cell& brick, const BrickMask& voxels) {
  CellBox box{{0, 0, kBrickEdge}, {0, 0, 0}};
  std::uint64_t columns = 0;  // Columns with a voxel in any slice.
  for (std::int32_t z = 0; z < kBrickEdge; ++z) {
    if (voxels[z] == 0) continue;
    columns |= voxels[z];
    box.min.z = std::min(box.min.z, z);
    box.max.z = z + 1;
  }
  box.min.y = __builtin_ctzll(columns) / kBrickEdge;
  box.max.y = kBrickEdge - __builtin_clzll(columns) / kBrickEdge;
  std::uint64_t row = columns | columns >> 32;
  row |= row >> 16;
  row = (row | row >> 8) & 0xff;
  box.min.x = __builtin_ctzll(row);
  box.max.x = 64 - __builtin_clzll(row);
  return {brick + box.min, brick + box.max};
}

CellBox boundsOf(const std::vector<FaceVertex>& vertices) {
  constexpr std::int16_t kFar = std::numeric_limits<std::int16_t>::max();
  std::array<std::int16_t, 3> min{kFar, kFar, kFar};
  std::array<std::int16_t, 3> max{-kFar, -kFar, -kFar};
  for (std::size_t i = 0; i < vertices.size(); i += 2) {  // Two opposite corners of each face.
    for (std::size_t axis = 0; axis < 3; ++axis) {
      min[axis] = std::min(min[axis], vertices[i].cell[axis]);
      max[axis] = std::max(max[axis], vertices[i].cell[axis]);
    }
  }
  return {{min[0], min[1], min[2]}, {max[0], max[1], max[2]}};
}

/// The corners of a side, counter-clockwise as seen from outside; bit i: upper end of axis i.
/// A cross section has the corners of the lower side, in the order of the upper side.
constexpr std::array<std::array<int, 4>, 7> kCorners{{{0, 4, 6, 2},
                                                      {1, 3, 7, 5},
                                                      {0, 1, 5, 4},
                                                      {2, 6, 7, 3},
                                                      {0, 2, 3, 1},
                                                      {4, 5, 7, 6},
                                                      {0, 1, 3, 2}}};

/// Whether a set has coarse faces: its hiding voxels are the shown voxels.
bool hasCoarseFaces(FaceSet set) { return set == FaceSet::kOccupied || set == FaceSet::kFree; }

/// The class of the cuboids in a set.
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
    if (hasCoarseFaces(set_)) coarse_cells_.add(brick.brick - chunk_, hiding_);
    changed_s_ = changed_s;
    const Occupancy wanted = classOf(set_);
    cuboids_.clear();
    divideVoxels(brick.brick,
                 wanted == Occupancy::kOccupied ? brick.voxels.occupied() : brick.voxels.free(),
                 wanted, cuboids_);
    for (const Cuboid& cuboid : cuboids_) {
      const auto look_of = [&] { return lookOf(brick.voxels, cuboid.box); };
      if (isSlice(set_)) {
        addCrossSection(cuboid.box, look_of);
      } else {
        addCuboid([&](int side) { return seenPart(brick.brick, cuboid.box, side); }, look_of);
      }
    }
  }
  /// All cuboids of the chunk, joined across its bricks.
  void addJoined(const ChangeTimeOf& changed_s) {
    const CellBox chunk{chunk_, chunk_ + Cell{kChunkEdge, kChunkEdge, kChunkEdge}};
    if (hasCoarseFaces(set_)) {
      map_.voxels().forEachIn(chunk, [&](const VoxelBrick& brick) {
        coarse_cells_.add(brick.brick - chunk_, hidingVoxels(brick.voxels, set_));
      });
    }
    const bool are_occupied = classOf(set_) == Occupancy::kOccupied;
    const auto filter = are_occupied ? CuboidFilter::kOccupied : CuboidFilter::kFree;
    const auto joined = joinCuboids(map_, chunk, filter, Budget::unlimited());
    for (const Cuboid& cuboid : joined.value) {
      const CellBox& box = cuboid.box;
      changed_s_ = kNever_s;
      (void)anyBrick(box, [&](const Cell& brick) {
        changed_s_ = std::max(changed_s_, changed_s(brick));
        return false;
      });
      const auto look_of = [&] {
        return makeLook(*cuboid_mapping::meanProbability(map_, box, Budget::unlimited()), box);
      };
      if (isSlice(set_)) {
        addCrossSection(box, look_of);
      } else {
        addCuboid([&](int side) { return seenPartOfJoined(box, side); }, look_of);
      }
    }
  }
  FaceMesh take() {
    sortBySide();
    if (hasCoarseFaces(set_)) addCoarseFaces();
    mesh_.bounds = boundsOf(mesh_.vertices);
    if (isSlice(set_)) ++mesh_.bounds.max.z;  // A cross section is drawn anywhere in its layer.
    return std::move(mesh_);
  }

 private:
  void sortBySide() {
    std::size_t num_vertices = 0;
    for (const std::vector<FaceVertex>& faces : faces_) num_vertices += faces.size();
    mesh_.vertices.reserve(num_vertices + num_vertices / 2);  // Includes coarse faces.
    FaceMesh::Part& cuboids = mesh_.levels[0];
    for (std::size_t i = 0; i < kSideOrder.size(); ++i) {
      const std::vector<FaceVertex>& faces = faces_[static_cast<std::size_t>(kSideOrder[i])];
      mesh_.vertices.insert(mesh_.vertices.end(), faces.begin(), faces.end());
      cuboids.ends[i] = mesh_.vertices.size() / 4;
    }
    mesh_.levels.fill(cuboids);
  }

  /// Data of a FaceVertex about its cuboid.
  struct Look {
    std::uint8_t probability;
    std::uint8_t size;
  };

  /// @param seen_part  (int side): the part of the box whose side is visible. @param look_of  (): Look of the
  ///                   box.
  template <typename SeenPartT, typename LookOfT>
  void addCuboid(const SeenPartT& seen_part, const LookOfT& look_of) {
    ++mesh_.num_cuboids;
    std::optional<Look> look;  // Computed for visible boxes only.
    for (int side = 0; side < 6; ++side) {
      const std::optional<CellBox> seen = seen_part(side);
      if (!seen) continue;
      if (!look) look = look_of();
      addFace(*seen, side, *look);
    }
  }

  template <typename LookOfT>
  void addCrossSection(const CellBox& box, const LookOfT& look_of) {
    if (slice_layer_ < box.min.z || slice_layer_ >= box.max.z) return;
    ++mesh_.num_cuboids;
    CellBox section = box;
    section.min.z = slice_layer_;
    addFace(section, kSliceSide, look_of());
  }

  /// Box around the part of a box whose side is visible: that part of the side is drawn.
  [[nodiscard]] std::optional<CellBox> seenPart(const Cell& brick, const CellBox& box, int side) {
    const CellBox layer = layerAt(box, side);
    const Cell other = brickOf(layer.min);
    const BrickMask voxels = BrickMask::ofBox(layer);
    const BrickMask open = voxels.without(hidingVoxelsAt(brick, other, side));
    if (open.isEmpty()) return std::nullopt;
    if (open == voxels) return box;
    CellBox part = boxAround(other, open);
    part.min[side / 2] = box.min[side / 2];
    part.max[side / 2] = box.max[side / 2];
    return part;
  }

  /// As above, for a box that may lie in several bricks.
  [[nodiscard]] std::optional<CellBox> seenPartOfJoined(const CellBox& box, int side) const {
    const CellBox layer = layerAt(box, side);
    std::optional<CellBox> seen;
    (void)anyBrick(layer, [&](const Cell& brick) {
      const PackedVoxels* voxels = map_.voxels().find(brick);
      const BrickMask open =
          BrickMask::ofBox(intersect(layer, brickBox(brick)))
              .without(voxels == nullptr ? BrickMask() : hidingVoxels(*voxels, set_));
      if (open.isEmpty()) return false;
      const CellBox part = boxAround(brick, open);
      seen = seen ? unite(*seen, part) : part;
      return false;
    });
    if (!seen) return std::nullopt;
    seen->min[side / 2] = box.min[side / 2];
    seen->max[side / 2] = box.max[side / 2];
    return seen;
  }

  /// Hiding voxels of the current brick, or of the one beside it.
  [[nodiscard]] const BrickMask& hidingVoxelsAt(const Cell& current, const Cell& brick, int side) {
    if (brick == current) return hiding_;
    std::optional<BrickMask>& hiding = hiding_beside_[static_cast<std::size_t>(side)];
    if (!hiding) {
      const PackedVoxels* voxels = map_.voxels().find(brick);
      hiding = voxels == nullptr ? BrickMask() : hidingVoxels(*voxels, set_);
    }
    return *hiding;
  }

  void addCoarseFaces() {
    constexpr std::size_t kFewFaces = 16;  // So few faces need no coarse level.
    if (mesh_.numFaces() < kFewFaces) return;
    for (std::size_t level = 1; level < kNumDetailLevels; ++level) {
      if (level > 1) coarse_cells_.coarsen();
      const FaceMesh::Part& finer = mesh_.levels[level - 1];
      const FaceMesh::Part part = coarse_cells_.appendFaces(mesh_.vertices);
      const bool is_worth_it = 2 * part.count() <= finer.count();
      const bool has_room = 2 * (part.first + part.count()) <= 3 * mesh_.numFaces();
      if (is_worth_it && has_room) {
        mesh_.levels[level] = part;
      } else {
        mesh_.levels[level] = finer;
        mesh_.vertices.resize(4 * part.first);
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

  static Look makeLook(double probability, const CellBox& cuboid) {
    const Cell edges = cuboid.size();
    const double size = (edges.x + edges.y + edges.z) / (3.0 * kBrickEdge);
    return {toByte(probability), toByte(std::min(1.0, size))};  // Joined cuboids may be larger.
  }
  static Look lookOf(const PackedVoxels& voxels, const CellBox& cuboid) {
    return makeLook(meanProbability(voxels, cuboid), cuboid);
  }

  void addFace(const CellBox& box, int side, const Look& look) {
    FaceVertex vertex{};
    vertex.probability = look.probability;
    vertex.size = look.size;
    vertex.changed_s = changed_s_;
    appendFace({box.min - chunk_, box.max - chunk_}, side, vertex,
               faces_[static_cast<std::size_t>(side)]);
  }

  const CuboidMap& map_;
  const Cell chunk_;
  const FaceSet set_;
  const std::int32_t slice_layer_;
  BrickMask hiding_;                                       ///< Hiding voxels of the current brick.
  std::array<std::optional<BrickMask>, 6> hiding_beside_;  ///< Those of its neighbours, by side.
  float changed_s_ = 0.0F;
  std::vector<Cuboid> cuboids_;
  CoarseCells coarse_cells_;
  std::array<std::vector<FaceVertex>, kSideOrder.size()> faces_;  ///< Faces of cuboids, by side.
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
  if (wanted.are_joined) {
    maker.addJoined(changed_s);
  } else {
    map.voxels().forEachIn(
        box, [&](const VoxelBrick& brick) { maker.add(brick, changed_s(brick.brick)); });
  }
  return maker.take();
}

}  // namespace cuboid_mapping_rviz
