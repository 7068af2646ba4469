// SPDX-License-Identifier: BSD-3-Clause
// The map without memory or threads: a change is made as if nothing had failed, or it throws and
// the map is unchanged; the same change can then be made again.
#include "cuboid_mapping/map/map_snapshot.h"
#include "cuboid_mapping/map/mapper.h"
#include "cuboid_mapping/sharing/map_follower.h"
#include "fault_campaign.h"
#include "support/modelled_map.h"
#include "support/snapshots.h"

namespace cuboid_mapping::campaign {
namespace {

using test::Random;

/// Observable content of a map.
struct MapContent {
  std::map<Cell, float> voxels;
  std::vector<Cuboid> cuboids;
  std::uint64_t revision;
  std::vector<CellBox> locked;
  double num_free;
  double num_occupied;
};

MapContent contentOf(const CuboidMap& map) {
  return {test::voxelsOf(map), test::allCuboids(map),        map.revision(),
          map.lockedBoxes(),   map.voxels().numFreeVoxels(), map.voxels().numOccupiedVoxels()};
}

/// Violation in a map; empty: none.
std::string findViolation(const CuboidMap& map) {
  const std::vector<std::string> violations = checkMap(map);
  if (violations.empty()) return {};
  return "unsound: " + violations.front().substr(0, violations.front().find(" ("));
}

/// Difference of a map from another; empty: none.
std::string compare(const CuboidMap& map, const MapContent& expected) {
  const std::string violation = findViolation(map);
  if (!violation.empty()) return violation;
  const MapContent content = contentOf(map);
  if (content.voxels != expected.voxels) return "other voxels";
  if (content.cuboids != expected.cuboids) return "other cuboids";
  if (content.revision != expected.revision) return "other revision";
  if (content.locked != expected.locked) return "other locks";
  if (content.num_free != expected.num_free) return "other number of free voxels";
  if (content.num_occupied != expected.num_occupied) return "other number of occupied voxels";
  return {};
}

ScanUpdate someUpdate(Random& random) {
  return test::randomUpdate(random, {{-2, -2, -2}, {2, 2, 2}}, 8);
}

/// Adds some clouds and locks to a map.
void fill(CuboidMap& map) {
  Random random(7);
  for (int i = 0; i < 30; ++i) map.apply(someUpdate(random));
  map.lock({{-9, -9, -9}, {-2, -2, -2}});
}

/// Fills a map without starting threads, which a later change needs.
void fillWithoutThreads(CuboidMap& map) {
  Random random(7);
  map.replace(kAllCells, test::randomSnapshot(random).bricks);
}

using Work = std::function<ChangeSet(CuboidMap&)>;

/// A change of a map under faults. Checks the map, the answer, and later changes.
class MapTrial {
 public:
  MapTrial(MapConfig config, std::function<void(CuboidMap&)> prepare, Work work)
      : config_(std::move(config)), prepare_(std::move(prepare)), work_(std::move(work)) {}

  std::string operator()(const Act& act) const {
    MapConfig plain_config = config_;
    plain_config.threads = 1;  // Threads are started where they can fail.
    CuboidMap plain(plain_config);
    prepare_(plain);
    const MapContent before = contentOf(plain);
    const ChangeSet expected = work_(plain);
    const MapContent after = contentOf(plain);

    CuboidMap map(config_);
    prepare_(map);
    ChangeSet changes;
    const bool has_thrown = act([&] { changes = work_(map); });
    std::string wrong = compare(map, has_thrown ? before : after);
    if (!wrong.empty()) return (has_thrown ? "after the exception " : "afterwards ") + wrong;
    if (has_thrown) {
      changes = work_(map);
      wrong = compare(map, after);
      if (!wrong.empty()) return "when done again " + wrong;
    }
    const bool is_told = changes.is_everything == expected.is_everything &&
                         changes.bricks.size() == expected.bricks.size();
    if (!is_told || changes.revision != expected.revision) return "other changes are told";
    goOn(plain);
    goOn(map);
    wrong = compare(map, contentOf(plain));
    return wrong.empty() ? wrong : "some clouds later " + wrong;
  }

 private:
  static void goOn(CuboidMap& map) {
    Random random(8);
    for (int i = 0; i < 12; ++i) map.apply(someUpdate(random));
  }

  MapConfig config_;
  std::function<void(CuboidMap&)> prepare_;
  Work work_;
};

struct Setting {
  const char* name;
  MapConfig config;
};

std::vector<Setting> settings() {
  std::vector<Setting> all;
  const auto add = [&all](const char* name, FusionKind fusion, int threads, bool is_static) {
    MapConfig config;
    config.resolution_m = 0.1;
    config.fusion = fusion;
    config.threads = threads;
    if (is_static) config.environment = Environment::kStatic;
    all.push_back({name, config});
  };
  add("class", FusionKind::kClass, 1, false);
  add("class, 3 threads", FusionKind::kClass, 3, false);
  add("none", FusionKind::kNone, 1, false);
  add("growth", FusionKind::kGrowth, 1, true);
  return all;
}

/// @return Number of failed calls.
std::size_t tryWork(const std::string& name, const Work& work) {
  std::size_t num_trials = 0;
  for (const Setting& setting : settings()) {
    num_trials += expectNothingWrong(name + ", " + setting.name, FaultKind::kMemory,
                                     MapTrial(setting.config, fill, work));
  }
  return num_trials;
}

TEST(CoreFaults, aCloudIsInOrNot) {
  Random random(9);
  const ScanUpdate update = someUpdate(random);
  EXPECT_GT(tryWork("apply", [&](CuboidMap& map) { return map.apply(update); }), 0U);
}

/// The cloud has more bricks than one thread takes at a time.
TEST(CoreFaults, aCloudIsInWithoutThreads) {
  MapConfig config;
  config.resolution_m = 0.1;
  config.threads = 3;
  Random random(9);
  const ScanUpdate update = test::randomUpdate(random, {{-9, -9, -9}, {9, 9, 9}}, 1000);
  ASSERT_GT(update.bricks.size(), 200U);
  const MapTrial trial(config, fillWithoutThreads,
                       [&](CuboidMap& map) { return map.apply(update); });
  EXPECT_GT(expectNothingWrong("apply, first threads", FaultKind::kThread, trial), 0U);
  EXPECT_GT(expectNothingWrong("apply, first threads", FaultKind::kMemory, trial), 0U);
}

TEST(CoreFaults, anEditIsInOrNot) {
  const CellBox box{{-11, -5, -6}, {7, 9, 4}};
  const std::vector<UniformBox> boxes{{{{-11, -5, -6}, {0, 0, 0}}, 1.5F},
                                      {{{2, 2, 2}, {5, 6, 4}}, -0.5F}};
  EXPECT_GT(tryWork("replace", [&](CuboidMap& map) { return map.replace(box, boxes); }), 0U);
  const std::vector<VoxelBrick> none;
  EXPECT_GT(tryWork("erase", [&](CuboidMap& map) { return map.replace(box, none); }), 0U);
}

TEST(CoreFaults, aLockIsThereOrNot) {
  const auto none = [](const CuboidMap& map) {
    ChangeSet changes;
    changes.revision = map.revision();
    return changes;
  };
  EXPECT_GT(tryWork("lock",
                    [&](CuboidMap& map) {
                      map.lock({{-5, -5, -5}, {3, 3, 3}});
                      return none(map);
                    }),
            0U);
  EXPECT_GT(tryWork("unlock",
                    [&](CuboidMap& map) {
                      map.unlock({{-5, -5, -5}, {3, 3, 3}});
                      return none(map);
                    }),
            0U);
}

TEST(CoreFaults, theSensorModelIsTheNewOneOrTheOld) {
  SensorModelConfig model;
  model.hit = 0.8;
  model.alpha_max = 0.9;
  EXPECT_GT(tryWork("setSensorModel", [&](CuboidMap& map) { return map.setSensorModel(model); }),
            0U);
}

TEST(CoreFaults, aMapIsReplacedOrNot) {
  MapSnapshot snapshot;
  {
    Random random(10);
    snapshot = test::randomSnapshot(random);
    snapshot.resolution_m = 0.1;  // The resolution of tryWork()'s maps.
  }
  EXPECT_GT(tryWork("clear", [](CuboidMap& map) { return map.clear(); }), 0U);
  EXPECT_GT(
      tryWork("restoreSnapshot", [&](CuboidMap& map) { return restoreSnapshot(snapshot, map); }),
      0U);
}

/// A scan that Mapper has taken gets into the map, and no other.
TEST(CoreFaults, aScanIsInOrNot) {
  for (const int threads : {1, 3}) {
    MapperConfig config;
    config.map.resolution_m = 0.1;
    config.map.threads = threads;
    const Trial trial = [config](const Act& act) -> std::string {
      Random random(11);
      std::vector<Scan> scans;
      for (int i = 0; i < 4; ++i) scans.push_back(test::randomScan(random, {}));
      const auto contentWith = [&](std::size_t count) {
        Mapper plain(config);
        for (std::size_t i = 0; i < count; ++i) plain.integrate(scans[i]);
        return contentOf(plain.map());
      };
      Mapper mapper(config);
      std::size_t num_taken = 0;
      const auto take = [&] {
        mapper.integrate(scans[num_taken]);
        ++num_taken;
      };
      while (num_taken < 2) take();
      (void)mapper.map();
      act([&] {
        while (num_taken < 4) take();
        (void)mapper.map();
      });
      std::string wrong = compare(mapper.map(), contentWith(num_taken));
      if (!wrong.empty()) return "of " + std::to_string(num_taken) + " scans " + wrong;
      while (num_taken < 4) take();
      return compare(mapper.map(), contentWith(4));
    };
    const std::string name = "integrate, " + std::to_string(threads) + " threads";
    EXPECT_GT(expectNothingWrong(name, FaultKind::kMemory, trial), 0U);
  }
}

TEST(CoreFaults, manyBricksAreInOrNot) {
  std::vector<VoxelBrick> bricks;
  Random random(14);
  for (const VoxelBrick& brick : test::randomSnapshot(random).bricks) bricks.push_back(brick);
  bricks.push_back({{0, 0, 0}, {}});
  EXPECT_GT(tryWork("replace bricks", [&](CuboidMap& map) { return map.replace(bricks); }), 0U);
}

/// A follower has a delta or not, and an image or not; it can take it again.
TEST(CoreFaults, aFollowerHasADeltaOrNot) {
  const Trial trial = [](const Act& act) -> std::string {
    CuboidMap map;
    fill(map);
    const MapImage image = makeImage(map, 3, MapDetail::kValues);
    const std::uint64_t base = map.revision();
    Random random(12);
    const ChangeSet changes = map.apply(someUpdate(random));
    const MapDelta delta = makeDelta(map, changes, 3, base, MapDetail::kValues);
    MapFollower follower;
    const bool has_thrown = act([&] {
      (void)follower.take(image);
      (void)follower.take(delta);
    });
    if (has_thrown) {
      // It may lack data, but reports it: nothing is lost silently.
      if (follower.take(delta) == FollowResult::kGap && !follower.take(image))
        return "image refused";
      (void)follower.take(delta);
    }
    if (follower.map() == nullptr) return "no copy";
    const bool is_same = test::voxelsOf(*follower.map()) == test::voxelsOf(map);
    if (!is_same) return "another map";
    return checkMap(*follower.map()).empty() ? "" : "unsound";
  };
  EXPECT_GT(expectNothingWrong("follow", FaultKind::kMemory, trial), 0U);
}

/// A follower that cannot take an image keeps its map and its revision.
TEST(CoreFaults, aFollowerKeepsItsMapWhereItCannotTakeAnother) {
  const Trial trial = [](const Act& act) -> std::string {
    CuboidMap map;
    fill(map);
    const MapImage first = makeImage(map, 3, MapDetail::kValues);
    const auto voxels_before = test::voxelsOf(map);
    Random random(13);
    map.apply(someUpdate(random));
    const MapImage second = makeImage(map, 3, MapDetail::kValues);
    MapFollower follower;
    (void)follower.take(first);
    const bool has_thrown = act([&] { (void)follower.take(second); });
    if (follower.revision() != (has_thrown ? first : second).revision) return "another revision";
    const auto expected = has_thrown ? voxels_before : test::voxelsOf(map);
    return test::voxelsOf(*follower.map()) == expected ? "" : "another map";
  };
  EXPECT_GT(expectNothingWrong("take an image", FaultKind::kMemory, trial), 0U);
}

}  // namespace
}  // namespace cuboid_mapping::campaign
