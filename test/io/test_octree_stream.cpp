// SPDX-License-Identifier: BSD-3-Clause
// Serialized octrees compared with those of OctoMap, byte by byte.
#include "cuboid_mapping/io/octree_stream.h"

#include "cuboid_mapping/io/octomap_files.h"
#include "cuboid_mapping/voxels/uniform_boxes.h"
#include "support/snapshots.h"

#include <gtest/gtest.h>
#include <octomap/ColorOcTree.h>
#include <octomap/OcTree.h>
#include <octomap/OcTreeStamped.h>

#include <algorithm>
#include <functional>
#include <sstream>

namespace cuboid_mapping {
namespace {

using test::Random;

/// The OcTree of a snapshot, built voxel by voxel.
octomap::OcTree makeTree(const MapSnapshot& snapshot) {
  octomap::OcTree tree(snapshot.resolution_m);
  for (const auto& [cell, log_odds] : test::voxelsOf(snapshot.bricks)) {
    if (!kOctreeCells.contains(cell)) continue;
    const auto key = [](std::int32_t v) { return static_cast<octomap::key_type>(v + 32768); };
    tree.setNodeValue(octomap::OcTreeKey(key(cell.x), key(cell.y), key(cell.z)), log_odds, true);
  }
  tree.updateInnerOccupancy();
  tree.prune();
  return tree;
}

std::string fullBytes(const octomap::OcTree& tree) {
  std::ostringstream out;
  tree.writeData(out);
  return out.str();
}

std::string binaryBytes(octomap::OcTree tree) {
  tree.toMaxLikelihood();
  tree.prune();
  std::ostringstream out;
  tree.writeBinaryData(out);
  return out.str();
}

/// The voxels of disjoint boxes.
std::map<Cell, float> voxelsOfBoxes(const std::vector<UniformBox>& boxes) {
  std::map<Cell, float> voxels;
  for (const UniformBox& box : boxes) {
    test::visitCells(box.box, [&](const Cell& cell) {
      EXPECT_TRUE(voxels.emplace(cell, box.log_odds).second) << cell << " is there twice";
    });
  }
  return voxels;
}

std::map<Cell, float> classesOf(const std::vector<VoxelBrick>& bricks) {
  std::map<Cell, float> classes = test::voxelsOf(bricks);
  for (auto& [cell, value] : classes) value = value >= 0.0F ? 1.0F : -1.0F;
  return classes;
}

/// Some bricks at the borders of the octree and around its centre, so that every level branches.
MapSnapshot randomOctreeSnapshot(Random& random) {
  const auto place = [&] {
    const std::int32_t places[] = {-32768, -8, 0, 1024, 32768 - 8};
    return places[random.index(5)];
  };
  return test::randomSnapshot(random, {place(), place(), place()});
}

TEST(OctreeStream, isByteByByteWhatOctomapWrites) {
  Random random(41);
  constexpr int kCases = 40;
  std::size_t num_nodes = 0;
  std::size_t num_left_out = 0;
  for (int i = 0; i < kCases; ++i) {
    const MapSnapshot snapshot = randomOctreeSnapshot(random);
    const octomap::OcTree tree = makeTree(snapshot);
    const OctreeStream full = toOctreeStream(snapshot.bricks, OctreeKind::kFull);
    ASSERT_TRUE(full.bytes == fullBytes(tree)) << test::seedNote(i);
    ASSERT_EQ(full.num_nodes, tree.size());
    const OctreeStream binary = toOctreeStream(snapshot.bricks, OctreeKind::kBinary);
    ASSERT_TRUE(binary.bytes == binaryBytes(tree)) << test::seedNote(i);
    num_nodes += full.num_nodes;
    num_left_out += full.num_left_out > 0.0 ? 1 : 0;
  }
  EXPECT_GT(num_nodes, 100000U);
  EXPECT_GT(num_left_out, 0U) << "some reach beyond the octree";
}

TEST(OctreeStream, prunesWholeBricksAndLarger) {
  MapSnapshot snapshot;
  snapshot.bricks =
      toBricks({{{{-64, -64, -64}, {64, 64, 64}}, 0.5F}, {{{64, 0, 0}, {72, 8, 8}}, -1.0F}}).bricks;
  const octomap::OcTree tree = makeTree(snapshot);
  const OctreeStream full = toOctreeStream(snapshot.bricks, OctreeKind::kFull);
  EXPECT_TRUE(full.bytes == fullBytes(tree));
  EXPECT_EQ(computeOctreeLeaves(snapshot.bricks, OctreeKind::kFull).size(), tree.getNumLeafNodes());
}

TEST(OctreeStream, ofAnEmptyMapHasNoBytes) {
  const OctreeStream full = toOctreeStream({}, OctreeKind::kFull);
  EXPECT_TRUE(full.bytes.empty());
  EXPECT_EQ(full.num_nodes, 0U);
  EXPECT_TRUE(readFullOctree("").leaves.empty());
  EXPECT_TRUE(readBinaryOctree("", -1.0F, 1.0F).leaves.empty());
}

void expectEqual(const std::vector<OctreeLeaf>& a, const std::vector<OctreeLeaf>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_TRUE(a[i].min == b[i].min && a[i].depth == b[i].depth && a[i].log_odds == b[i].log_odds);
  }
}

TEST(OctreeStream, givesTheVoxelsBack) {
  Random random(42);
  for (int i = 0; i < 20; ++i) {
    const MapSnapshot snapshot = test::randomSnapshot(random);
    const OctreeStream full = toOctreeStream(snapshot.bricks, OctreeKind::kFull);
    const OctreeContent content = readFullOctree(full.bytes);
    ASSERT_EQ(voxelsOfBoxes(content.leaves), test::voxelsOf(snapshot.bricks)) << test::seedNote(i);
    EXPECT_EQ(content.num_nodes, full.num_nodes);
    const OctreeStream binary = toOctreeStream(snapshot.bricks, OctreeKind::kBinary);
    ASSERT_EQ(voxelsOfBoxes(readBinaryOctree(binary.bytes, -1.0F, 1.0F).leaves),
              classesOf(snapshot.bricks));
    std::size_t num_voxels = 0;
    for (const OctreeLeaf& leaf : computeOctreeLeaves(snapshot.bricks, OctreeKind::kBinary)) {
      num_voxels += static_cast<std::size_t>(leaf.edge()) * leaf.edge() * leaf.edge();
    }
    EXPECT_EQ(num_voxels, test::voxelsOf(snapshot.bricks).size());
    std::vector<OctreeLeaf> all = computeOctreeLeaves(snapshot.bricks, OctreeKind::kFull);
    const auto middle = std::stable_partition(
        all.begin(), all.end(), [](const OctreeLeaf& leaf) { return leaf.log_odds >= 0.0F; });
    expectEqual(computeOctreeLeaves(snapshot.bricks, OctreeKind::kFull, CuboidFilter::kOccupied),
                {all.begin(), middle});
    expectEqual(computeOctreeLeaves(snapshot.bricks, OctreeKind::kFull, CuboidFilter::kFree),
                {middle, all.end()});
  }
}

TEST(OctreeStream, noticesDamage) {
  const auto defect_of = [](const std::function<void()>& read) {
    try {
      read();
    } catch (const MapFileError& error) {
      return error.defect();
    }
    return MapFileDefect::kForeign;  // stands for: none
  };
  Random random(43);
  const MapSnapshot snapshot = test::randomSnapshot(random);
  const std::string full = toOctreeStream(snapshot.bricks, OctreeKind::kFull).bytes;
  const std::string binary = toOctreeStream(snapshot.bricks, OctreeKind::kBinary).bytes;
  for (const std::size_t length : {std::size_t{1}, full.size() / 2, full.size() - 1}) {
    EXPECT_EQ(defect_of([&] { (void)readFullOctree(full.substr(0, length)); }),
              MapFileDefect::kTruncated);
  }
  EXPECT_EQ(defect_of([&] { (void)readBinaryOctree(binary.substr(0, binary.size() - 1), 0, 0); }),
            MapFileDefect::kTruncated);
  EXPECT_EQ(defect_of([&] { (void)readFullOctree(full + "x"); }), MapFileDefect::kCorrupted);
  std::string deep;
  for (int i = 0; i < 1000000; ++i) deep += std::string("\0\0\0\0\1", 5);
  EXPECT_EQ(defect_of([&] { (void)readFullOctree(deep); }), MapFileDefect::kCorrupted);
  EXPECT_EQ(defect_of([&] { (void)readBinaryOctree(std::string(1000000, '\x3'), 0, 0); }),
            MapFileDefect::kCorrupted);
  EXPECT_EQ(defect_of([&] { (void)readFullOctree(std::string("\0\0\xC0\x7F\0", 5)); }),
            MapFileDefect::kCorrupted);
}

/// A file written by OctoMap.
template <typename TreeT>
std::string writeFile(TreeT& tree, OctreeKind kind) {
  std::ostringstream out;
  EXPECT_TRUE(kind == OctreeKind::kFull ? tree.write(out) : tree.writeBinary(out));
  return out.str();
}

TEST(OctomapFiles, areByteByByteWhatOctomapWrites) {
  Random random(44);
  for (int i = 0; i < 8; ++i) {
    MapSnapshot snapshot = test::randomSnapshot(random);
    snapshot.resolution_m = i == 0 ? 0.05 : snapshot.resolution_m;
    octomap::OcTree tree = makeTree(snapshot);
    std::string expected = writeFile(tree, OctreeKind::kFull);
    std::string written = toOctomapFile(snapshot, OctreeKind::kFull);
    const auto without_resolution = [](const std::string& file) {
      const std::size_t at = file.find("\nres ");
      return file.substr(0, at) + file.substr(file.find('\n', at + 1));
    };
    EXPECT_TRUE(without_resolution(written) == without_resolution(expected));
    if (i == 0) {
      EXPECT_TRUE(written == expected);
    }
    EXPECT_TRUE(without_resolution(toOctomapFile(snapshot, OctreeKind::kBinary)) ==
                without_resolution(writeFile(tree, OctreeKind::kBinary)));
  }
}

TEST(OctomapFiles, areReadAsOctomapReadsThem) {
  Random random(45);
  MapSnapshot snapshot = test::randomSnapshot(random);
  snapshot.resolution_m = 0.25;
  octomap::OcTree tree = makeTree(snapshot);
  const MapSnapshot full = fromOctomapFile(writeFile(tree, OctreeKind::kFull));
  EXPECT_EQ(full.resolution_m, 0.25);
  EXPECT_EQ(test::voxelsOf(full.bricks), test::voxelsOf(snapshot.bricks));
  const SensorModelConfig model{0.8, 0.3, 0.2, 0.9};
  const MapSnapshot binary = fromOctomapFile(writeFile(tree, OctreeKind::kBinary), model);
  EXPECT_EQ(classesOf(binary.bricks), classesOf(snapshot.bricks));
  EXPECT_TRUE(test::isSameModel(binary.sensor_model, model));
  for (const auto& [cell, log_odds] : test::voxelsOf(binary.bricks)) {
    const SensorModel expected(model);
    EXPECT_TRUE(log_odds == expected.min() || log_odds == expected.max()) << cell;
  }
}

TEST(OctomapFiles, withColoursOrStampsAreRead) {
  octomap::ColorOcTree colored(0.5);
  octomap::OcTreeStamped stamped(0.5);
  for (const float x : {-3.0F, 0.2F, 7.0F}) {
    colored.updateNode(octomap::point3d(x, 1.0F, 2.0F), true);
    colored.setNodeColor(x, 1.0F, 2.0F, 10, 20, 30);
    stamped.updateNode(octomap::point3d(x, 1.0F, 2.0F), true);
  }
  const auto expected = voxelsOfBoxes({{CellBox::ofCell({-6, 2, 4}), 0.0F},
                                       {CellBox::ofCell({0, 2, 4}), 0.0F},
                                       {CellBox::ofCell({14, 2, 4}), 0.0F}});
  for (const std::string& file :
       {writeFile(colored, OctreeKind::kFull), writeFile(stamped, OctreeKind::kFull)}) {
    const auto voxels = test::voxelsOf(fromOctomapFile(file).bricks);
    ASSERT_EQ(voxels.size(), 3U);
    for (const auto& [cell, log_odds] : voxels) {
      EXPECT_EQ(expected.count(cell), 1U) << cell;
      EXPECT_NEAR(log_odds, toLogOdds(0.7), 1e-6);
    }
  }
}

TEST(OctomapFiles, thatAreDamagedAreRefused) {
  Random random(46);
  const std::string good = toOctomapFile(test::randomSnapshot(random), OctreeKind::kFull);
  const auto defect_of = [](const std::string& bytes) {
    try {
      (void)fromOctomapFile(bytes);
    } catch (const MapFileError& error) {
      return error.defect();
    }
    return MapFileDefect::kInaccessible;  // stands for: none
  };
  const auto replaced = [&good](const std::string& key, const std::string& value) {
    const std::size_t at = good.find("\n" + key + " ") + key.size() + 2;
    return good.substr(0, at) + value + good.substr(good.find('\n', at));
  };
  EXPECT_NO_THROW((void)fromOctomapFile(replaced("id", "\t OcTree ")));  // As OctoMap itself.
  EXPECT_EQ(defect_of("a poem\n"), MapFileDefect::kForeign);
  EXPECT_EQ(defect_of(replaced("id", "SemanticOcTree")), MapFileDefect::kForeign);
  EXPECT_EQ(defect_of(good.substr(0, 90)), MapFileDefect::kTruncated);
  EXPECT_EQ(defect_of(good.substr(0, good.size() / 2)), MapFileDefect::kTruncated);
  EXPECT_EQ(defect_of(replaced("size", "7")), MapFileDefect::kCorrupted);
  EXPECT_EQ(defect_of(replaced("size", "seven")), MapFileDefect::kCorrupted);
  EXPECT_EQ(defect_of(replaced("res", "-0.1")), MapFileDefect::kCorrupted);
  EXPECT_EQ(defect_of(replaced("size", "99999999999999999")), MapFileDefect::kTooBig);
  EXPECT_EQ(defect_of(good + "more"), MapFileDefect::kCorrupted);
  // One leaf as the whole octree: 2^39 bricks.
  const std::string whole("# Octomap OcTree file\nid OcTree\nsize 1\nres 0.1\ndata\n\0\0\0\0\0",
                          57);
  EXPECT_EQ(defect_of(whole), MapFileDefect::kTooBig);
}

TEST(OctomapFiles, cannotHoldWhatIsFarAway) {
  MapSnapshot snapshot;
  snapshot.bricks = toBricks({{CellBox::ofCell({32768, 0, 0}), 1.0F}}).bricks;
  try {
    (void)toOctomapFile(snapshot, OctreeKind::kFull);
    FAIL();
  } catch (const MapFileError& error) {
    EXPECT_EQ(error.defect(), MapFileDefect::kTooBig);
  }
}

}  // namespace
}  // namespace cuboid_mapping
