// SPDX-License-Identifier: BSD-3-Clause
// Measures how long corrected poses take on real scans, against insertion, and the bytes of kept clouds.
#include "command_line.h"
#include "cuboid_mapping/history/kept_clouds.h"
#include "cuboid_mapping/history/map_history.h"
#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/scan/scan_update.h"
#include "data_sets/scan_dataset.h"
#include "timing.h"

#include <algorithm>
#include <cstdio>
#include <optional>
#include <string>
#include <vector>

namespace cuboid_mapping::bench {
namespace {

struct Options {
  std::string dataset;
  double resolution_m = 0.2;
  int threads = 1;
  int rounds = 5;
  int laps = 1;
  double moved = 1.0;
};

using Poses = std::vector<Eigen::Isometry3d>;

/// Clouds of a data set as the node keeps them, a second apart. Each lap is elsewhere.
std::vector<KeptCloud> readClouds(const Options& options) {
  constexpr double kBetweenLaps_m = 300.0;
  std::vector<KeptCloud> clouds;
  const auto scans = openScanDataset(options.dataset);
  for (std::size_t i = 0; i < scans->size(); ++i) {
    const ScanDataset::Item item = scans->read(i);
    KeptCloud cloud;
    cloud.T_map_body = item.T_map_sensor;
    cloud.scans_body.emplace_back();
    cloud.scans_body.back().points = item.points_sensor;
    roundScan(cloud.scans_body.back(), options.resolution_m / kKeptStepsPerVoxel);
    clouds.push_back(std::move(cloud));
  }
  const std::size_t num_a_lap = clouds.size();
  for (std::size_t i = num_a_lap; i < num_a_lap * static_cast<std::size_t>(options.laps); ++i) {
    clouds.push_back(clouds[i - num_a_lap]);
    clouds.back().T_map_body.pretranslate(Eigen::Vector3d(kBetweenLaps_m, 0.0, 0.0));
  }
  for (std::size_t i = 0; i < clouds.size(); ++i) {
    clouds[i].stamp_ns = static_cast<std::int64_t>(1000000000 * (i + 1));
    clouds[i].T_map_body = PoseTrack({{0, clouds[i].T_map_body}}).at(0);  // As the node rounds it.
  }
  return clouds;
}

/// Poses of the last clouds drift from the first of them on. @param share  Of the clouds, that these are.
Poses moved(const std::vector<KeptCloud>& clouds, double share) {
  Poses poses;
  const double first = (1.0 - share) * static_cast<double>(clouds.size());
  for (std::size_t i = 0; i < clouds.size(); ++i) {
    const double drift =
        std::max(0.0, static_cast<double>(i) - first) / static_cast<double>(clouds.size());
    poses.push_back(clouds[i].T_map_body * Eigen::Translation3d(drift, -0.5 * drift, 0.1 * drift) *
                    Eigen::AngleAxisd(0.02 * drift, Eigen::Vector3d::UnitZ()));
  }
  return poses;
}

MapConfig makeConfig(const Options& options) {
  MapConfig config;
  config.resolution_m = options.resolution_m;
  config.threads = options.threads;
  return config;
}

/// Inserts the clouds one after the other. @param history  Keeps them; may be null.
CuboidMap insert(const std::vector<KeptCloud>& clouds, const Options& options,
                 MapHistory* history) {
  CuboidMap map(makeConfig(options));
  ScanUpdater updater(map.grid(), BeamRanges{}, options.threads);
  if (history != nullptr) history->restart(map);
  for (const KeptCloud& cloud : clouds) {
    map.apply(updater.compute(placeScan(cloud.T_map_body, cloud.scans_body.front())));
    if (history != nullptr) history->add(cloud, {});
  }
  return map;
}

/// Bricks of either map that the other one has not, or has with other log-odds.
std::size_t countDifferent(const CuboidMap& a, const CuboidMap& b) {
  std::size_t num_same = 0;
  a.voxels().forEach([&](const VoxelBrick& brick) {
    const PackedVoxels* other = b.voxels().find(brick.brick);
    num_same += other != nullptr && *other == brick.voxels ? 1U : 0U;
  });
  return a.voxels().size() + b.voxels().size() - 2 * num_same;
}

/// Times of the same work, round by round.
struct Times {
  std::vector<double> wall_s;
  std::vector<double> cpu_s;

  void add(const Timing& timing) {
    wall_s.push_back(timing.wall_s);
    cpu_s.push_back(timing.cpu_s);
  }
};

void measure(const Options& options) {
  constexpr double kTolerance_m = 1e-6;  // For what rounding moves.
  const std::vector<KeptCloud> clouds = readClouds(options);
  const Poses poses = moved(clouds, options.moved);
  std::vector<KeptCloud> clouds_there = clouds;
  std::vector<StampedPose> path;
  for (std::size_t i = 0; i < clouds.size(); ++i) {
    path.push_back({clouds[i].stamp_ns, poses[i]});
  }
  const PoseTrack track(path);
  for (std::size_t i = 0; i < clouds.size(); ++i) {
    if (!poses[i].isApprox(clouds[i].T_map_body, kTolerance_m)) {
      clouds_there[i].T_map_body = track.at(clouds[i].stamp_ns);
    }
  }
  MapHistory history(makeConfig(options), options.resolution_m / kKeptStepsPerVoxel, {});
  Times inserting;
  Times correcting;
  std::size_t num_different = 0;
  for (int round = 0; round < options.rounds; ++round) {
    std::optional<CuboidMap> there;
    inserting.add(timeOf([&] { there.emplace(insert(clouds_there, options, nullptr)); }));
    const CuboidMap map = insert(clouds, options, &history);
    std::optional<MapCorrection> correction;
    correcting.add(timeOf([&] {
      correction.emplace(history.correct(track, {OutsidePoses::kFollow, kTolerance_m}));
    }));
    num_different += countDifferent(*there, correction->map());
  }
  const HistoryFigures kept = history.figures();
  std::printf(
      "%s at %.2f m, %zu clouds, %d threads, medians of %d\n\n"
      "| insertion [s] | correction [s] | ratio | ratio of CPU time | bricks that differ | "
      "bytes a cloud | bytes a point |\n|---|---|---|---|---|---|---|\n"
      "| %.3f | %.3f | %.2f | %.2f | %zu | %.0f | %.2f |\n",
      options.dataset.c_str(), options.resolution_m, clouds.size(), options.threads, options.rounds,
      median(inserting.wall_s), median(correcting.wall_s),
      median(correcting.wall_s) / median(inserting.wall_s),
      median(correcting.cpu_s) / median(inserting.cpu_s), num_different,
      static_cast<double>(kept.num_bytes) / static_cast<double>(kept.num_clouds),
      static_cast<double>(kept.num_bytes) / static_cast<double>(kept.num_points));
}

int run(int argc, char** argv) {
  Options options;
  CommandLine line("pose_corrections",
                   "Measures how long corrected poses take on real scans, against insertion, and "
                   "the bytes of kept clouds.");
  line.addArgument("dataset", options.dataset, "folder of scans, or .graph file");
  line.addNumber("resolution", options.resolution_m, "edge of a voxel [m]", {0.001, 100.0});
  line.addNumber("threads", options.threads, "threads of both", {1, 256});
  line.addNumber("moved", options.moved, "share of the clouds, the last ones, that moves",
                 {0.001, 1.0});
  line.addNumber("laps", options.laps, "repetitions of the drive, 300 m apart", {1, 1000});
  line.addNumber("rounds", options.rounds, "repetitions", {1, 1000});
  if (const auto status = line.parse(argc, argv)) return *status;
  measure(options);
  return 0;
}

}  // namespace
}  // namespace cuboid_mapping::bench

int main(int argc, char** argv) {
  return cuboid_mapping::runMain("pose_corrections", argc, argv, cuboid_mapping::bench::run);
}
