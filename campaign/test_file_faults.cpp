// SPDX-License-Identifier: BSD-3-Clause
// Saves and loads without memory, disk space or rights: a file is the old one or the new one, whole; a
// map is the file's or the old one; and the answer says which.
#include "cuboid_mapping/io/file_replacement.h"
#include "cuboid_mapping/ros/map/map_storage.h"
#include "fault_campaign.h"
#include "ros/random_guarded_map.h"
#include "tools/run_program.h"

#include <filesystem>

namespace cuboid_mapping::campaign {
namespace {

using cuboid_mapping_ros::GuardedMap;
using cuboid_mapping_ros::loadMap;
using cuboid_mapping_ros::saveMap;
using cuboid_mapping_ros::StorageAnswer;
using cuboid_mapping_ros::test::fill;
using cuboid_mapping_ros::test::makeConfig;
using cuboid_mapping_ros::test::voxelsOf;
using test::Random;

constexpr FaultKind kAllKinds[] = {FaultKind::kMemory, FaultKind::kOpen, FaultKind::kWrite,
                                   FaultKind::kSync, FaultKind::kRename};

TEST(FileFaults, aFileIsTheOldOneOrTheNewOne) {
  for (const std::string name : {"map.cuboids", "map.ot", "map.bt", "map.csv"}) {
    const Trial trial = [name](const Act& act) -> std::string {
      const test::TemporaryFolder folder;
      const std::string file = folder / name;
      Random random(1);
      GuardedMap old_map(makeConfig());
      fill(old_map, random);
      GuardedMap map(makeConfig());
      fill(map, random);
      if (!saveMap(map, "map", file).error.empty()) return "cannot save";
      const std::string expected = readFile(file);
      if (!saveMap(old_map, "map", file).error.empty()) return "cannot save";
      const std::string before = readFile(file);
      StorageAnswer answer;
      const bool has_thrown = act([&] { answer = saveMap(map, "map", file); });
      const bool is_reported = has_thrown || !answer.error.empty();
      const std::string after = readFile(file);
      if (after != before && after != expected) return "neither the old nor the new file";
      if (!is_reported && after != expected) return "success without the new file";
      if (std::filesystem::exists(file + ".partial")) return "a part stays";
      if (!saveMap(map, "map", file).error.empty()) return "cannot save any more";
      return readFile(file) == expected ? "" : "another file later";
    };
    for (const FaultKind kind : kAllKinds) {
      EXPECT_GT(expectNothingWrong("save " + name, kind, trial), 0U);
    }
  }
}

TEST(FileFaults, aMapIsThatOfTheFileOrTheOneBefore) {
  for (const std::string name : {"map.cuboids", "map.ot"}) {
    const Trial trial = [name](const Act& act) -> std::string {
      const test::TemporaryFolder folder;
      const std::string file = folder / name;
      Random random(1);
      GuardedMap saved(makeConfig());
      fill(saved, random);
      if (!saveMap(saved, "map", file).error.empty()) return "cannot save";
      GuardedMap map(makeConfig());
      fill(map, random);
      const auto before = voxelsOf(map);
      (void)map.takeChanges();
      StorageAnswer answer;
      const bool has_thrown = act([&] { answer = loadMap(map, file); });
      const bool is_reported = has_thrown || !answer.error.empty();
      if (voxelsOf(map) != (is_reported ? before : voxelsOf(saved))) {
        return is_reported ? "another map after an error" : "success without the map";
      }
      const bool is_told = map.takeChanges().is_everything;
      if (!is_reported && !is_told) return "nobody is told of the new map";
      if (!loadMap(map, file).error.empty()) return "cannot load any more";
      return voxelsOf(map) == voxelsOf(saved) ? "" : "another map later";
    };
    for (const FaultKind kind : {FaultKind::kMemory, FaultKind::kOpen}) {
      EXPECT_GT(expectNothingWrong("load " + name, kind, trial), 0U);
    }
  }
}

}  // namespace
}  // namespace cuboid_mapping::campaign
