// SPDX-License-Identifier: BSD-3-Clause
// Random streams of all changes of a map, compared with one number for each voxel.
#include "cuboid_mapping/io/native_format.h"
#include "cuboid_mapping/map/map_snapshot.h"
#include "cuboid_mapping/query/nearest_query.h"
#include "cuboid_mapping/sharing/map_follower.h"
#include "support/map_invariants.h"

#include "support/following_copy.h"
#include "support/random_bricks.h"

#include <gtest/gtest.h>

#include <map>
#include <set>
#include <string>
#include <tuple>
#include <vector>

namespace cuboid_mapping {
namespace {

using test::Random;

/// Area of clouds and edits: parts of eight bricks.
constexpr CellBox kArea{{-5, -5, -3}, {5, 5, 4}};

/// A map without bricks, cuboids, or packing.
struct ReferenceMap {
  std::map<Cell, float> voxels;
  std::set<Cell> locked;

  void apply(const ScanUpdate& update, const SensorModel& model) {
    for (const auto& [cell, is_hit] : test::toObservedCells(update)) {
      if (locked.count(cell) != 0) continue;
      float& log_odds = voxels.emplace(cell, 0.0F).first->second;
      const bool is_stable = log_odds <= model.min() || log_odds >= model.max();
      if (is_stable && model.environment() == Environment::kStatic) continue;
      const float sum = log_odds + (is_hit ? model.hit() : model.miss());
      log_odds = std::min(std::max(sum, model.min()), model.max());
    }
  }

  /// The update with grazes of unknown voxels as misses.
  [[nodiscard]] ScanUpdate withGrazes(ScanUpdate update) const {
    for (BrickUpdate& brick : update.bricks) {
      forEachCell(brick.brick, brick.grazes, [&](const Cell& cell) {
        if (voxels.count(cell) == 0) brick.misses.set(voxelIndex(cell));
      });
    }
    return update;
  }

  void erase(const CellBox& box) {
    for (auto voxel = voxels.begin(); voxel != voxels.end();) {
      voxel = box.contains(voxel->first) ? voxels.erase(voxel) : std::next(voxel);
    }
  }
};

/// Whether a map has these voxels and no others.
testing::AssertionResult hasValues(const CuboidMap& map, const std::map<Cell, float>& voxels) {
  testing::AssertionResult result = testing::AssertionSuccess();
  std::size_t num_voxels = 0;
  map.voxels().forEach([&](const VoxelBrick& brick) {
    VoxelValues values;
    brick.voxels.getValues(values);
    forEachCell(brick.brick, brick.voxels.known(), [&](const Cell& cell) {
      const float value = values[static_cast<std::size_t>(voxelIndex(cell))];
      const auto expected = voxels.find(cell);
      ++num_voxels;
      if (expected != voxels.end() && expected->second == value) return;
      result = testing::AssertionFailure() << cell << " has " << value;
    });
  });
  if (result && num_voxels != voxels.size()) {
    return testing::AssertionFailure() << num_voxels << " voxels instead of " << voxels.size();
  }
  return result;
}

SensorModelConfig randomModel(Random& random) {
  if (random.chance(0.3)) return {};
  return {random.real(0.55, 0.9), random.real(0.2, 0.45), random.real(0.05, 0.3),
          random.real(0.7, 0.97)};
}

MapConfig randomConfig(Random& random, FusionKind fusion, Environment environment) {
  MapConfig config;
  config.resolution_m = 1.0;
  config.fusion = fusion;
  config.environment = environment;
  config.sensor_model = randomModel(random);
  config.rtree = random.chance(0.5) ? RTreeConfig{4, 2} : RTreeConfig{};
  config.threads = random.chance(0.1) ? 2 : 1;
  config.growth.settle_clouds = random.integer(0, 3);
  if (random.chance(0.3)) config.growth.sampling.per_m = 0.0;
  return config;
}

/// A map, its reference, and copies that follow the map.
class Stream {
 public:
  Stream(std::uint64_t number, FusionKind fusion, Environment environment)
      : random_(number),
        map_(randomConfig(random_, fusion, environment)),
        updater_(map_.grid(), BeamRanges{8.0, random_.chance(0.5) ? 2.5 : 0.0}, 1,
                 map_.config().beamSampling()) {}

  void step() {
    const std::uint64_t revision = map_.revision();
    const std::map<Cell, float> before = reference_.voxels;
    const std::vector<Cuboid> cuboids_before = copy_.cuboids();
    is_cleared_ = false;
    const int kind = random_.integer(0, 99);
    if (kind < 40) {
      applyCloud();
    } else if (kind < 60) {
      edit();
    } else if (kind < 70) {
      lock();
    } else if (kind < 80) {
      window();
    } else if (kind < 86) {
      read();
    } else if (kind < 94) {
      note(map_.setSensorModel(randomModel(random_)));
    } else if (kind < 98) {
      saveAndRestore();
    } else {
      forgetAll();
      note(map_.clear());
    }
    const bool is_regrown = copy_.cuboids() != cuboids_before;  // Also without a changed voxel.
    const bool is_changed = is_cleared_ || is_regrown || reference_.voxels != before;
    EXPECT_EQ(map_.revision() > revision, is_changed) << "step of kind " << kind;
    check(kind);
  }

  [[nodiscard]] std::size_t numVoxels() const { return reference_.voxels.size(); }
  [[nodiscard]] std::size_t numCuboids() const { return copy_.size(); }

 private:
  void note(const ChangeSet& changes) {
    EXPECT_EQ(changes.revision, map_.revision());
    copy_.follow(map_, changes);
    changes_.is_everything = changes_.is_everything || changes.is_everything;
    changes_.bricks.insert(changes_.bricks.end(), changes.bricks.begin(), changes.bricks.end());
  }

  ScanUpdate nextUpdate() {
    test::ScanShape shape;
    shape.num_points = random_.integer(1, 6);
    shape.num_no_returns = random_.integer(0, 2);
    shape.half_edge_m = 5.0;
    shape.resolution_m = 1.0;
    if (random_.chance(0.5)) return updater_.compute(test::randomScan(random_, shape));
    ScanUpdate update;
    const auto mark = [&](const CellBox& box, bool is_hit) {
      forEachBrick(box, [&](const Cell& brick) {
        const BrickMask part = BrickMask::ofBox(intersect(box, brickBox(brick)));
        auto found = std::find_if(update.bricks.begin(), update.bricks.end(),
                                  [&](const BrickUpdate& b) { return b.brick == brick; });
        if (found == update.bricks.end()) {
          update.bricks.push_back({brick, {}, {}});
          found = std::prev(update.bricks.end());
        }
        (is_hit ? found->hits : found->misses) |= part;
      });
    };
    for (int i = random_.integer(0, 2); i > 0; --i)
      mark(test::randomBoxInside(random_, kArea), false);
    if (random_.chance(0.5)) mark(test::randomBox(random_, kArea, 3), true);
    sortBricks(update.bricks);
    return update;
  }

  /// Applies a cloud, sometimes several times, until its voxels are stable.
  void applyCloud() {
    const ScanUpdate update = nextUpdate();
    for (int i = random_.chance(0.3) ? random_.integer(1, 8) : 1; i > 0; --i) {
      reference_.apply(reference_.withGrazes(update), map_.sensorModel());
      note(map_.apply(update));
    }
  }

  float randomValue() {
    const SensorModel& model = map_.sensorModel();
    const float values[] = {-1.0F, 1.5F, 0.0F, model.min(), model.max(), 100.0F, -100.0F};
    return random_.chance(0.2) ? static_cast<float>(random_.real(-4.0, 4.0))
                               : values[random_.index(7)];
  }

  void edit() {
    const CellBox box = random_.chance(0.05) ? kAllCells : test::randomBoxInside(random_, kArea);
    const CellBox part = intersect(box, kArea);
    reference_.erase(box);
    if (random_.chance(0.3)) return editWithBricks(box, part);
    std::vector<UniformBox> boxes;
    if (random_.chance(0.5)) {  // Merges one after the other.
      const std::int32_t middle = random_.integer(part.min.x, part.max.x);
      boxes.push_back({{part.min, {middle, part.max.y, part.max.z}}, randomValue()});
      boxes.push_back({{{middle, part.min.y, part.min.z}, part.max}, randomValue()});
    } else if (random_.chance(0.7)) {
      boxes.push_back({part, randomValue()});
    }
    for (const UniformBox& uniform : boxes) {
      test::visitCells(uniform.box,
                       [&](const Cell& cell) { reference_.voxels[cell] = uniform.log_odds; });
    }
    note(map_.replace(box, boxes));
  }

  void editWithBricks(const CellBox& box, const CellBox& part) {
    std::vector<VoxelBrick> bricks;
    forEachBrick(part, [&](const Cell& brick) {
      test::BrickValues values = test::randomBrickValues(random_);
      values.brick = brick;
      if (random_.chance(0.5)) values.known &= BrickMask::ofBox(intersect(part, brickBox(brick)));
      if (box == kAllCells) values.known &= BrickMask::ofBox(intersect(part, brickBox(brick)));
      bricks.push_back(values.pack());
      forEachCell(brick, values.known, [&](const Cell& cell) {
        if (!box.contains(cell)) return;
        reference_.voxels[cell] = values.log_odds[static_cast<std::size_t>(voxelIndex(cell))];
      });
    });
    note(map_.replace(box, bricks));
  }

  void lock() {
    const CellBox box = test::randomBox(random_, kArea, 6);
    const bool is_lock = random_.chance(0.6);
    is_lock ? map_.lock(box) : map_.unlock(box);
    test::visitCells(box, [&](const Cell& cell) {
      is_lock ? (void)reference_.locked.insert(cell) : (void)reference_.locked.erase(cell);
    });
  }

  void read() {
    if (random_.chance(0.5)) {
      EXPECT_EQ(countCuboids(map_).total(), test::allCuboids(map_).size());
      return;
    }
    const auto nearest = findNearest(map_, test::randomPoint(random_, 6.0), 1, CuboidFilter::kAll,
                                     Budget::unlimited());
    EXPECT_EQ(nearest.isNotFound(), reference_.voxels.empty());
  }

  /// Cuboids of a part are those of the whole that lie there.
  void window() {
    const CellBox box = test::randomBox(random_, kArea, 6);
    std::vector<Cuboid> expected = test::allCuboids(map_);
    expected.erase(
        std::remove_if(expected.begin(), expected.end(),
                       [&](const Cuboid& cuboid) { return !cuboid.box.intersects(box); }),
        expected.end());
    EXPECT_EQ(test::cuboidsIn(map_, box), expected);
  }

  void forgetAll() {
    reference_ = {};
    is_cleared_ = true;
  }

  /// Writes the map to a file, and reads it back, with its locks.
  void saveAndRestore() {
    const MapSnapshot snapshot = takeSnapshot(map_, "map");
    const auto fault = findFault(snapshot);
    EXPECT_FALSE(fault) << fault->text;
    const std::string bytes = toNativeFormat(snapshot);
    const MapSnapshot read = fromNativeFormat(bytes);
    EXPECT_EQ(toNativeFormat(read), bytes);
    if (random_.chance(0.5)) map_.apply(nextUpdate());  // This must leave no trace.
    is_cleared_ = true;
    note(restoreSnapshot(read, map_));
  }

  void check(int kind) {
    ASSERT_TRUE(hasValues(map_, reference_.voxels)) << "step of kind " << kind;
    ASSERT_EQ(checkMap(map_), std::vector<std::string>{}) << "step of kind " << kind;
    ASSERT_EQ(copy_.cuboids(), test::allCuboids(map_)) << "step of kind " << kind;
    if (random_.chance(0.5)) checkFollower();
  }

  void checkFollower() {
    const MapDelta delta = makeDelta(map_, changes_, 1, told_, MapDetail::kValues);
    const FollowResult result = follower_.take(delta);
    if (result == FollowResult::kGap) {
      ASSERT_TRUE(follower_.map() == nullptr || changes_.is_everything);
      ASSERT_TRUE(follower_.take(makeImage(map_, 1, MapDetail::kValues)));
    } else {
      ASSERT_NE(result, FollowResult::kDamaged);
    }
    changes_ = {};
    told_ = map_.revision();
    ASSERT_TRUE(hasValues(*follower_.map(), reference_.voxels));
    ASSERT_EQ(checkMap(*follower_.map()), std::vector<std::string>{});
  }

  Random random_;
  CuboidMap map_;
  ReferenceMap reference_;
  ScanUpdater updater_;
  bool is_cleared_ = false;  ///< Set if this step has cleared the map.
  test::FollowingCopy copy_;
  MapFollower follower_;
  ChangeSet changes_;  ///< Changes since the follower's last update.
  std::uint64_t told_ = 0;
};

using ReferenceParam = std::tuple<FusionKind, Environment>;
class ReferenceOfCuboidMap : public testing::TestWithParam<ReferenceParam> {};

TEST_P(ReferenceOfCuboidMap, isEqualVoxelByVoxelAfterEachStepOfAnyStream) {
  const auto& [fusion, environment] = GetParam();
  constexpr std::size_t kStreams = 2500;  // Number of streams for each of six configurations.
  constexpr std::size_t kSteps = 12;
  std::size_t num_steps = 0;
  std::size_t num_voxels = 0;
  std::size_t num_fused_away = 0;
  for (std::size_t i = 0; i < kStreams; ++i) {
    Stream stream(i, fusion, environment);
    for (std::size_t step = 0; step < kSteps; ++step, ++num_steps) {
      stream.step();
      ASSERT_FALSE(HasFailure()) << test::seedNote(i) << ", step " << step;
      num_voxels += stream.numVoxels();
      num_fused_away += stream.numVoxels() - stream.numCuboids();
    }
  }
  EXPECT_EQ(num_steps, kStreams * kSteps);
  EXPECT_GT(num_voxels, 50 * num_steps);
  EXPECT_EQ(num_fused_away > num_voxels / 10, fusion != FusionKind::kNone)
      << num_fused_away << " of " << num_voxels;
}

std::string nameOf(const testing::TestParamInfo<ReferenceParam>& info) {
  const auto& [fusion, environment] = info.param;
  return toString(fusion) + std::string(environment == Environment::kStatic ? "Static" : "Dynamic");
}

INSTANTIATE_TEST_SUITE_P(
    AllConfigs, ReferenceOfCuboidMap,
    testing::Combine(testing::Values(FusionKind::kClass, FusionKind::kGrowth, FusionKind::kNone),
                     testing::Values(Environment::kDynamic, Environment::kStatic)),
    nameOf);

}  // namespace
}  // namespace cuboid_mapping
