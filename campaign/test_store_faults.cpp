// SPDX-License-Identifier: BSD-3-Clause
// A window and a history without memory: a cloud is in or not, and nothing else is lost.
#include "cuboid_mapping/history/kept_clouds.h"
#include "cuboid_mapping/history/map_history.h"
#include "cuboid_mapping/window/map_window.h"
#include "fault_campaign.h"
#include "support/modelled_map.h"
#include "support/snapshots.h"
#include "tools/run_program.h"

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace cuboid_mapping::campaign {
namespace {

using test::Random;

/// Few calls of the history need memory: nearly all are tried.
constexpr std::size_t kManyTrials = 60;

MapConfig tenthOfAMetre() {
  MapConfig config;
  config.resolution_m = 0.1;
  return config;
}

/// A map with a window that drives there and back, over pages that were evicted.
class Drive {
 public:
  Drive() : map_(tenthOfAMetre()) {
    window_ = std::make_unique<MapWindow>(
        WindowConfig{3.2, 0.0, OutsideWindow::kKeep},
        openStoreOf(takeSnapshot(map_, "map"), folder_ / "map.sqlite"), map_);
    go(40);
  }

  /// Puts clouds in. Where it throws, the next call goes on with the cloud that is not in.
  void go(int count) {
    for (const int end = step_ + count; step_ < end; ++step_) {
      const ScanUpdate update = updateOf(step_);
      ChangeSet changes;
      const Eigen::Vector3d center_map(0.1 * kBrickEdge * placeOf(step_).x, 0.0, 0.0);
      const ScanUpdate& admitted = window_->admit(update, center_map, changes);
      CuboidMap::PendingChange change = map_.prepare(admitted, map_.sensorModel());
      window_->commit(change, changes);
    }
  }
  void goTo(int step) { go(step - step_); }

  void edit() {
    ChangeSet changes;
    window_->edit(
        kBox, [&] { return map_.replace(kBox, kWall); }, changes);
    edited_at_ = step_;
  }
  void clear() {
    ChangeSet changes;
    window_->replaceAll([&] { return map_.clear(); }, changes);
    cleared_at_ = step_;
  }
  void save() { (void)window_->save(); }

  /// Difference of the map, and of its store, from a map without a window; empty: none.
  std::string compare() {
    const std::map<Cell, float> expected = voxelsWithoutWindow();
    MapSnapshot whole = takeSnapshot(map_, "map");
    for (const Cell& page : window_->storedPages()) window_->addStored(page, {}, whole);
    sortBricks(whole.bricks);
    if (const auto fault = findFault(whole)) return "unsound: " + fault->text;
    if (test::voxelsOf(whole.bricks) != expected) return "other voxels";
    if (!window_->save()) return "cannot be saved";
    window_.reset();
    const MapStore store(folder_ / "map.sqlite", StoreAccess::kRead);
    if (test::voxelsOf(readStore(store).bricks) != expected) return "other store";
    return checkMap(map_).empty() ? "" : "unsound map";
  }

 private:
  static constexpr CellBox kBox{{64, -16, -16}, {160, 16, 16}};
  inline static const std::vector<UniformBox> kWall{{kBox, 1.0F}};

  static Cell placeOf(int step) { return {4 * (step < 40 ? step : 80 - step), 0, 0}; }
  static ScanUpdate updateOf(int step) {
    Random random(100 + static_cast<std::size_t>(step));
    const Cell brick = placeOf(step);
    return test::randomUpdate(random, {brick - Cell{3, 3, 2}, brick + Cell{3, 3, 2}}, 12);
  }
  [[nodiscard]] std::map<Cell, float> voxelsWithoutWindow() const {
    CuboidMap plain(tenthOfAMetre());
    for (int step = 0; step < step_; ++step) {
      if (step == edited_at_) plain.replace(kBox, kWall);
      if (step == cleared_at_) plain.clear();
      plain.apply(updateOf(step));
    }
    return test::voxelsOf(plain);
  }

  test::TemporaryFolder folder_;
  CuboidMap map_;
  std::unique_ptr<MapWindow> window_;
  int step_ = 0;
  int edited_at_ = -1;
  int cleared_at_ = -1;
};

/// A drive in the midst of which something is done, again if it has failed.
Trial driveWith(const std::function<void(Drive&)>& work) {
  return [work](const Act& act) -> std::string {
    Drive drive;
    if (act([&] { work(drive); })) work(drive);
    drive.goTo(75);
    return drive.compare();
  };
}

TEST(StoreFaults, aWindowLosesNoPage) {
  const auto drive = driveWith([](Drive& it) { it.goTo(49); });
  EXPECT_GT(expectNothingWrong("drive with a window", FaultKind::kMemory, drive), 0U);
  const auto edit = driveWith([](Drive& it) { it.edit(); });
  EXPECT_GT(expectNothingWrong("edit with a window", FaultKind::kMemory, edit), 0U);
  const auto save = driveWith([](Drive& it) { it.save(); });
  EXPECT_GT(expectNothingWrong("save a window", FaultKind::kMemory, save), 0U);
  const auto clear = driveWith([](Drive& it) { it.clear(); });
  EXPECT_GT(expectNothingWrong("clear the map of a window", FaultKind::kMemory, clear), 0U);
}

/// A history whose limits let some clouds become fixed, and clouds for it.
class HistoryDrive {
 public:
  explicit HistoryDrive(std::uint64_t max_bytes) : history_(tenthOfAMetre(), kStep_m, {max_bytes}) {
    Random random(31);
    for (int i = 0; i < 12; ++i) {
      KeptCloud cloud;
      cloud.stamp_ns = std::int64_t{1'000'000'000} * (i + 1);
      cloud.T_map_body.translation().x() = 0.1 * i;
      cloud.scans_body.push_back(test::randomScan(random, {}));
      roundScan(cloud.scans_body.back(), kStep_m);
      clouds_.push_back(std::move(cloud));
    }
  }

  void add(std::size_t first, std::size_t count) {
    for (next_ = first; next_ < first + count; ++next_) history_.add(clouds_[next_], {});
  }
  /// The cloud that the last call of add() did not add.
  [[nodiscard]] std::size_t next() const { return next_; }
  void edit(CuboidMap& map) { history_.addEdit(kBox, map); }

  /// The voxels after a correction that moves nothing.
  [[nodiscard]] std::map<Cell, float> voxels() {
    std::vector<StampedPose> poses;
    for (const KeptCloud& cloud : clouds_) poses.push_back({cloud.stamp_ns, cloud.T_map_body});
    return test::voxelsOf(history_.correct(PoseTrack(poses)).map());
  }
  [[nodiscard]] HistoryFigures figures() const { return history_.figures(); }

  static constexpr CellBox kBox{{-8, -8, -8}, {8, 8, 8}};

 private:
  static constexpr double kStep_m = 0.1 / 16.0;
  MapHistory history_;
  std::vector<KeptCloud> clouds_;
  std::size_t next_ = 0;
};

TEST(StoreFaults, aHistoryHasACloudOnce) {
  for (const std::uint64_t max_bytes : {std::uint64_t{1} << 30, std::uint64_t{600}}) {
    const Trial trial = [max_bytes](const Act& act) -> std::string {
      const auto add_edit = [](HistoryDrive& drive) {
        CuboidMap map(tenthOfAMetre());
        map.replace(HistoryDrive::kBox, {UniformBox{HistoryDrive::kBox, 0.5F}});
        map.lock({{0, 0, 0}, {4, 4, 4}});
        drive.edit(map);
      };
      HistoryDrive plain(max_bytes);
      plain.add(0, 6);
      add_edit(plain);
      plain.add(6, 6);
      if ((plain.figures().num_fixed > 2) != (max_bytes < 1000)) {
        return std::to_string(plain.figures().num_bytes) + " bytes of " +
               std::to_string(plain.figures().num_clouds) + " clouds";
      }

      HistoryDrive drive(max_bytes);
      drive.add(0, 4);
      if (act([&] { drive.add(4, 2); })) drive.add(drive.next(), 6 - drive.next());
      add_edit(drive);
      drive.add(6, 6);
      const HistoryFigures expected = plain.figures();
      const HistoryFigures figures = drive.figures();
      if (figures.num_clouds + figures.num_fixed != 12) return "another number of clouds";
      if (figures.num_clouds != expected.num_clouds) return "another number of kept clouds";
      if (figures.num_bytes != expected.num_bytes) return "another size";
      if (figures.num_points != expected.num_points) return "another number of points";
      return drive.voxels() == plain.voxels() ? "" : "other voxels";
    };
    const std::string name = "add clouds, " + std::to_string(max_bytes) + " bytes";
    EXPECT_GT(expectNothingWrong(name, FaultKind::kMemory, trial, kManyTrials), 0U);
  }
}

TEST(StoreFaults, aHistoryHasAnEditOrNot) {
  const Trial trial = [](const Act& act) -> std::string {
    CuboidMap map(tenthOfAMetre());
    map.replace(HistoryDrive::kBox, {UniformBox{HistoryDrive::kBox, 0.5F}});
    map.lock({{0, 0, 0}, {4, 4, 4}});
    HistoryDrive plain(1 << 30);
    plain.add(0, 6);
    plain.edit(map);
    plain.add(6, 6);
    HistoryDrive drive(1 << 30);
    drive.add(0, 6);
    if (act([&] { drive.edit(map); })) drive.edit(map);
    drive.add(6, 6);
    return drive.voxels() == plain.voxels() ? "" : "other voxels";
  };
  EXPECT_GT(expectNothingWrong("add an edit", FaultKind::kMemory, trial, kManyTrials), 0U);
}

}  // namespace
}  // namespace cuboid_mapping::campaign
