// SPDX-License-Identifier: BSD-3-Clause
// A guarded map with a window: nobody waits for the disk.
#include "cuboid_mapping/io/map_store.h"
#include "cuboid_mapping/ros/map/guarded_map.h"
#include "support/full_disk.h"
#include "support/watched_disk.h"
#include "tools/run_program.h"

#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <future>
#include <memory>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::CellBox;
using cuboid_mapping::CuboidMap;
using cuboid_mapping::ScanUpdate;

class GuardedWindow : public ::testing::Test {
 protected:
  GuardedWindow() { open(); }

  /// Opens the store; SQLite then has none of its pages in memory.
  void open() {
    map_ = nullptr;  // It has the store alone.
    map_ = std::make_unique<GuardedMap>(cuboid_mapping::MapConfig());
    map_->setWindow([this](CuboidMap& map) {
      cuboid_mapping::WindowConfig config;
      config.size_m = 10.0;
      config.margin_m = 1.0;
      const cuboid_mapping::MapConfig& of_map = map.config();
      auto store = cuboid_mapping::openStoreOf(
          {of_map.resolution_m, of_map.sensor_model, of_map.environment, "map", {}}, file_);
      return std::make_unique<cuboid_mapping::MapWindow>(config, std::move(store), map);
    });
  }

  /// The robot stands at 0 m or at 1 km, for long enough that the other place leaves memory.
  void stayAt(std::int32_t x_m) {
    ScanUpdate update;
    update.bricks.push_back({{x_m * 20, 0, 0}, cuboid_mapping::BrickMask::all(), {}});
    for (int i = 0; i < 30; ++i) {
      map_->integrate(ros::Time(1.0), update, cuboid_mapping::SensorModel(), {1.0 * x_m, 0.0, 0.0});
    }
  }

  /// Expects that work reads or writes the disk, and that others can read the map at each time.
  void expectOthersReadDuring(const std::function<void()>& work) {
    bool has_waited = false;
    int num_calls = 0;
    std::vector<std::future<ros::Time>> readers;
    const cuboid_mapping::test::WatchedDisk disk([&] {
      ++num_calls;
      if (has_waited) return;
      readers.push_back(std::async(std::launch::async, [this] { return map_->stamp(); }));
      const std::future_status status = readers.back().wait_for(std::chrono::seconds(5));
      has_waited = status != std::future_status::ready;
    });
    work();
    EXPECT_FALSE(has_waited);
    EXPECT_GT(num_calls, 0);
  }

  cuboid_mapping::test::TemporaryFolder folder_;
  std::string file_ = folder_ / "map.sqlite";
  std::unique_ptr<GuardedMap> map_;
};

TEST_F(GuardedWindow, OthersReadTheMapWhileACloudMovesTheWindow) {
  stayAt(0);
  expectOthersReadDuring([this] { stayAt(1000); });
  EXPECT_EQ(map_->windowFigures()->num_writes, 1U);
  expectOthersReadDuring([this] { stayAt(0); });
  EXPECT_EQ(map_->windowFigures()->num_loads, 1U);
}

TEST_F(GuardedWindow, OthersReadTheMapWhileItIsSaved) {
  stayAt(0);
  expectOthersReadDuring([this] { EXPECT_EQ(map_->save(), ""); });
  expectOthersReadDuring([this] { map_->saveHead(); });
  expectOthersReadDuring([this] { map_->replaceAll([](CuboidMap& map) { return map.clear(); }); });
}

TEST_F(GuardedWindow, ASaveDoesNotWaitForALongReader) {
  stayAt(0);
  map_->read([this](const CuboidMap& /*map*/) {
        auto save = std::async(std::launch::async, [this] { EXPECT_EQ(map_->save(), ""); });
        EXPECT_EQ(save.wait_for(std::chrono::seconds(5)), std::future_status::ready);
        return save;
      })
      .get();
}

TEST_F(GuardedWindow, ASaveReturnsItsOwnErrorOnly) {
  stayAt(0);
  {
    const cuboid_mapping::test::FullDisk full;
    const std::string error = map_->save();
    EXPECT_EQ(error.rfind(file_, 0), 0U) << error;
  }
  EXPECT_EQ(map_->save(), "");
  EXPECT_GT(map_->windowFigures()->num_failures, 0U);
}

TEST_F(GuardedWindow, OthersReadTheMapWhilePagesAreLoaded) {
  const CellBox box{{0, 0, 0}, {8, 8, 8}};
  stayAt(0);
  ASSERT_EQ(map_->save(), "");
  open();
  ASSERT_EQ(map_->countNotLoaded(box), 1U);
  expectOthersReadDuring([&] { map_->load(box); });
  open();
  expectOthersReadDuring([&] {
    map_->editIn(box, [&](CuboidMap& map) { return map.replace(box, {{box, 1.0F}}); });
  });
  EXPECT_EQ(map_->windowFigures()->num_loads, 1U);
}

}  // namespace
}  // namespace cuboid_mapping_ros
