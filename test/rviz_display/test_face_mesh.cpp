// SPDX-License-Identifier: BSD-3-Clause
#include "rviz_display/face_mesh.h"

#include "support/random_bricks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

namespace cuboid_mapping_rviz {
namespace {

using namespace cuboid_mapping;

/// A side of a voxel.
using VoxelSide = std::tuple<Cell, int>;

Cell neighbourAt(const Cell& cell, int side) {
  Cell neighbour = cell;
  neighbour[side / 2] += side % 2 == 0 ? -1 : 1;
  return neighbour;
}

bool isOfSet(FaceSet set, Occupancy occupancy) {
  return occupancy == (set == FaceSet::kOccupied ? Occupancy::kOccupied : Occupancy::kFree);
}

/// Whether a side of a voxel of the set is visible, voxel by voxel.
bool isExposed(const CuboidMap& map, FaceSet set, const Cell& cell, int side) {
  const Occupancy behind = map.voxels().at(neighbourAt(cell, side));
  return set == FaceSet::kFrontier ? behind == Occupancy::kUnknown : !isOfSet(set, behind);
}

std::set<Cell> chunksOf(const CuboidMap& map) {
  std::set<Cell> chunks;
  map.voxels().forEach([&](const VoxelBrick& brick) { chunks.insert(chunkOf(brick.brick)); });
  return chunks;
}

/// The sides of voxels that a face covers; its corners are those of a side of a box.
std::vector<VoxelSide> sidesOf(const FaceVertex* corners, const Cell& chunk) {
  CellBox box{{1 << 20, 1 << 20, 1 << 20}, {-(1 << 20), -(1 << 20), -(1 << 20)}};
  const int side = corners[0].code / 4;
  for (int i = 0; i < 4; ++i) {
    EXPECT_EQ(corners[i].code, 4 * side + i);
    for (int axis = 0; axis < 3; ++axis) {
      const std::int32_t at = chunk[axis] + corners[i].cell[static_cast<std::size_t>(axis)];
      box.min[axis] = std::min(box.min[axis], at);
      box.max[axis] = std::max(box.max[axis], at);
    }
  }
  const int axis = side / 2;
  EXPECT_EQ(box.min[axis], box.max[axis]);
  (side % 2 == 0 ? box.max[axis] : box.min[axis]) += side % 2 == 0 ? 1 : -1;
  std::vector<VoxelSide> sides;
  for (Cell c = box.min; c.z < box.max.z; ++c.z) {
    for (c.y = box.min.y; c.y < box.max.y; ++c.y) {
      for (c.x = box.min.x; c.x < box.max.x; ++c.x) sides.emplace_back(c, side);
    }
  }
  return sides;
}

void include(const Cell& cell, CellBox& box) {
  for (int axis = 0; axis < 3; ++axis) {
    box.min[axis] = std::min(box.min[axis], cell[axis]);
    box.max[axis] = std::max(box.max[axis], cell[axis] + 1);
  }
}

/// Normal of the triangle of the first three corners, the front side for the graphics card.
Cell normalOf(const FaceVertex* corners) {
  const auto edge = [&](int from, int to, std::size_t axis) {
    return corners[to].cell[axis] - corners[from].cell[axis];
  };
  Cell normal;
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>((axis + 1) % 3);
    const auto b = static_cast<std::size_t>((axis + 2) % 3);
    normal[axis] = edge(0, 1, a) * edge(1, 2, b) - edge(0, 1, b) * edge(1, 2, a);
  }
  return normal;
}

class FaceMeshOfSet : public testing::TestWithParam<FaceSet> {};

TEST_P(FaceMeshOfSet, showsEachExposedSideOnceAndNoFaceThatIsHidden) {
  cuboid_mapping::test::Random random(1);
  for (int round = 0; round < 10; ++round) {
    CuboidMap map;
    for (int i = 0; i < 5; ++i)
      map.apply(cuboid_mapping::test::randomUpdate(random, {{-3, -3, -3}, {3, 3, 3}}, 20));
    std::map<VoxelSide, int> shown;
    for (const Cell& chunk : chunksOf(map)) {
      const bool are_joined = round % 2 == 1;
      const FaceMesh mesh =
          makeFaces(map, {chunk, GetParam(), 0, are_joined}, [](const Cell&) { return 0.0F; });
      for (std::size_t face = 0; face < mesh.numFaces(); ++face) {
        const FaceVertex* corners = &mesh.vertices[4 * face];
        const int side = corners[0].code / 4;
        const Cell normal = normalOf(corners);
        EXPECT_GT((side % 2 == 0 ? -1 : 1) * normal[side / 2], 0);
        const std::vector<VoxelSide> all = sidesOf(corners, chunk);
        CellBox seen{std::get<0>(all.back()), std::get<0>(all.front())};  // Empty at first.
        for (const VoxelSide& voxel_side : all) {
          ++shown[voxel_side];
          const Cell& cell = std::get<0>(voxel_side);
          EXPECT_TRUE(isOfSet(GetParam(), map.voxels().at(cell)));
          if (isExposed(map, GetParam(), cell, side)) include(cell, seen);
        }
        const CellBox whole{std::get<0>(all.front()), std::get<0>(all.back()) + Cell{1, 1, 1}};
        EXPECT_EQ(seen, whole);  // Not larger than the visible faces.
      }
    }
    std::size_t num_exposed = 0;
    map.voxels().forEach([&](const VoxelBrick& brick) {
      forEachCell(brick.brick, brick.voxels.known(), [&](const Cell& cell) {
        if (!isOfSet(GetParam(), map.voxels().at(cell))) return;
        for (int side = 0; side < 6; ++side) {
          if (!isExposed(map, GetParam(), cell, side)) continue;
          ++num_exposed;
          EXPECT_EQ((shown[{cell, side}]), 1);
        }
      });
    });
    EXPECT_GT(num_exposed, 100U);
  }
}

TEST(FaceMesh, joinsAWallAcrossBricks) {
  CuboidMap map;
  const CellBox wall{{0, 3, 0}, {70, 4, 20}};
  map.replace(kAllCells, {UniformBox{wall, 1.0F}});
  const auto changed_s = [](const Cell& brick) { return brick == Cell{8, 0, 8} ? 7.0F : 2.0F; };
  const FaceMesh tiles = makeFaces(map, {{0, 0, 0}, FaceSet::kOccupied, 0, false}, changed_s);
  const FaceMesh joined = makeFaces(map, {{0, 0, 0}, FaceSet::kOccupied, 0, true}, changed_s);
  EXPECT_EQ(tiles.num_cuboids, 24U);
  EXPECT_EQ(joined.num_cuboids, 1U);
  EXPECT_EQ(joined.numFaces(), 5U) << "the next chunk hides one";
  EXPECT_EQ(joined.bounds, (CellBox{{0, 3, 0}, {64, 4, 20}}));
  for (const FaceVertex& vertex : joined.vertices) {
    EXPECT_EQ(vertex.changed_s, 7.0F);
    EXPECT_EQ(vertex.size, 255) << "64 + 1 + 20 of 24 voxels";
  }
}

INSTANTIATE_TEST_SUITE_P(Sets, FaceMeshOfSet,
                         testing::Values(FaceSet::kOccupied, FaceSet::kFree, FaceSet::kFrontier));

class SliceOfSet : public testing::TestWithParam<FaceSet> {};

TEST_P(SliceOfSet, coversEachVoxelOfItsLayerAndClassOnce) {
  cuboid_mapping::test::Random random(2);
  CuboidMap map;
  for (int i = 0; i < 5; ++i)
    map.apply(cuboid_mapping::test::randomUpdate(random, {{-3, -3, -3}, {3, 3, 3}}, 20));
  const Occupancy wanted =
      GetParam() == FaceSet::kOccupiedSlice ? Occupancy::kOccupied : Occupancy::kFree;
  std::size_t num_all = 0;
  const std::vector<std::pair<std::int32_t, bool>> cuts{
      {-9, false}, {-3, false}, {-1, true}, {0, false}, {0, true}, {2, false}, {3, true}};
  for (const auto& cut : cuts) {
    const std::int32_t layer = cut.first;
    const bool are_joined = cut.second;
    std::map<Cell, int> shown;
    for (const Cell& chunk : chunksOf(map)) {
      const FaceMesh mesh =
          makeFaces(map, {chunk, GetParam(), layer, are_joined}, [](const Cell&) { return 0.0F; });
      for (std::size_t face = 0; face < mesh.numFaces(); ++face) {
        const FaceVertex* corners = &mesh.vertices[4 * face];
        EXPECT_GT(normalOf(corners).z, 0);
        EXPECT_EQ(chunk.z + corners[0].cell[2], layer);
        for (int x = corners[0].cell[0]; x < corners[2].cell[0]; ++x) {
          for (int y = corners[0].cell[1]; y < corners[2].cell[1]; ++y) {
            ++shown[{chunk.x + x, chunk.y + y, layer}];
          }
        }
      }
    }
    std::size_t num_voxels = 0;
    map.voxels().forEach([&](const VoxelBrick& brick) {
      forEachCell(brick.brick, brick.voxels.known(), [&](const Cell& cell) {
        if (cell.z != layer || map.voxels().at(cell) != wanted) return;
        ++num_voxels;
        EXPECT_EQ(shown[cell], 1);
      });
    });
    EXPECT_EQ(shown.size(), num_voxels);
    num_all += num_voxels;
  }
  EXPECT_GT(num_all, 10U);
}

INSTANTIATE_TEST_SUITE_P(Sets, SliceOfSet,
                         testing::Values(FaceSet::kOccupiedSlice, FaceSet::kFreeSlice));

/// The cells with edges of 2^level voxels in a chunk that have a voxel of a class.
std::set<Cell> coarseCells(const CuboidMap& map, const Cell& chunk, int level) {
  std::set<Cell> cells;
  const CellBox box{chunk, chunk + Cell{kChunkEdge, kChunkEdge, kChunkEdge}};
  map.voxels().forEachIn(box, [&](const VoxelBrick& brick) {
    forEachCell(brick.brick, brick.voxels.occupied(), [&](const Cell& cell) {
      const Cell local = cell - chunk;
      cells.insert({local.x >> level, local.y >> level, local.z >> level});
    });
  });
  return cells;
}

TEST(FaceMesh, hasTheSidesOfCoarseCellsOnceEach) {
  cuboid_mapping::test::Random random(4);
  CuboidMap map;
  for (int i = 0; i < 5; ++i)
    map.apply(cuboid_mapping::test::randomUpdate(random, {{-3, -3, -3}, {3, 3, 3}}, 20));
  int num_coarse_levels = 0;
  for (const Cell& chunk : chunksOf(map)) {
    const FaceMesh mesh =
        makeFaces(map, {chunk, FaceSet::kOccupied}, [](const Cell&) { return 0.0F; });
    EXPECT_LE(2 * mesh.vertices.size(), 3 * 4 * mesh.numFaces());
    for (int level = 1; level < static_cast<int>(kNumDetailLevels); ++level) {
      const FaceMesh::Part& part = mesh.levels[static_cast<std::size_t>(level)];
      const FaceMesh::Part& finer = mesh.levels[static_cast<std::size_t>(level - 1)];
      if (part.first == finer.first) continue;  // It would save too little.
      ++num_coarse_levels;
      EXPECT_TRUE(part.is_coarse);
      std::map<VoxelSide, int> shown;
      for (std::size_t face = part.first; face < part.first + part.count(); ++face) {
        const FaceVertex* corners = &mesh.vertices[4 * face];
        EXPECT_GT((corners[0].code / 4 % 2 == 0 ? -1 : 1) * normalOf(corners)[corners[0].code / 8],
                  0);
        for (const auto& [voxel, side] : sidesOf(corners, {0, 0, 0})) {
          ++shown[{{voxel.x >> level, voxel.y >> level, voxel.z >> level}, side}];
        }
      }
      const std::set<Cell> cells = coarseCells(map, chunk, level);
      std::size_t num_exposed = 0;
      for (const Cell& cell : cells) {
        for (int side = 0; side < 6; ++side) {
          if (cells.count(neighbourAt(cell, side)) > 0) continue;
          ++num_exposed;
          EXPECT_EQ((shown[{cell, side}]), 1 << 2 * level);  // All voxels of the side, once.
        }
      }
      EXPECT_EQ(shown.size(), num_exposed);
    }
  }
  EXPECT_GT(num_coarse_levels, 0);
}

TEST(FaceMesh, saysHowHighCoarseFacesLieAboveTheirVoxels) {
  CuboidMap map;
  // A floor of tiles with grooves between them: no cell has a voxel in its upper half.
  std::vector<UniformBox> floor;
  for (std::int32_t x = 0; x < 64; x += 2) {
    for (std::int32_t y = 0; y < 64; y += 2)
      floor.push_back({{{x, y, 0}, {x + 1, y + 1, 1}}, 1.0F});
  }
  map.replace(kAllCells, floor);
  const FaceMesh mesh =
      makeFaces(map, {{0, 0, 0}, FaceSet::kOccupied}, [](const Cell&) { return 0.0F; });
  for (std::size_t level = 1; level < kNumDetailLevels; ++level) {
    const FaceMesh::Part& part = mesh.levels[level];
    const FaceMesh::Part& finer = mesh.levels[level - 1];
    ASSERT_TRUE(part.is_coarse);
    if (level > 1 && part.first == finer.first) continue;
    EXPECT_EQ(part.count(), 6U);  // One slab.
    for (std::size_t i = 4 * part.first; i < 4 * (part.first + part.count()); ++i) {
      const FaceVertex& vertex = mesh.vertices[i];
      const int upper_mm = 125 * (8 * vertex.cell[2] - vertex.size);
      const bool is_upper = vertex.code / 4 == 5;
      EXPECT_EQ(is_upper ? upper_mm : 1000, 1000);
      EXPECT_EQ(is_upper || vertex.size == 0, true);
    }
  }
}

TEST(FaceMesh, tellsProbabilitySizeAndTimeOfChange) {
  CuboidMap map;
  map.replace(kAllCells, {{{{0, 0, 0}, {2, 1, 1}}, 0.0F}, {{{2, 0, 0}, {3, 1, 1}}, -1.0F}});
  const FaceMesh mesh =
      makeFaces(map, {{0, 0, 0}, FaceSet::kOccupied}, [](const Cell&) { return 7.0F; });
  ASSERT_EQ(mesh.numFaces(), 6U);
  EXPECT_EQ(mesh.num_cuboids, 1U);
  for (const FaceVertex& vertex : mesh.vertices) {
    EXPECT_EQ(vertex.probability, 128);  // 0.5
    EXPECT_EQ(vertex.size, 43);          // edges 2, 1 and 1 of 24
    EXPECT_EQ(vertex.changed_s, 7.0F);
  }
}

TEST(FaceMesh, hidesFacesBetweenChunks) {
  CuboidMap map;
  map.replace(kAllCells, {{{{56, 0, 0}, {72, 8, 8}}, 1.0F}});
  for (const Cell& chunk : {Cell{0, 0, 0}, Cell{64, 0, 0}}) {
    const FaceMesh mesh =
        makeFaces(map, {chunk, FaceSet::kOccupied}, [](const Cell&) { return 0.0F; });
    EXPECT_EQ(mesh.numFaces(), 5U);
  }
}

}  // namespace
}  // namespace cuboid_mapping_rviz
