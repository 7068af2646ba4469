// SPDX-License-Identifier: BSD-3-Clause
// bag_to_map on several processes and machines: mpirun -n N bag_to_map_mpi BAG... -o FILE
#include "bag_clouds.h"
#include "brick_owner.h"
#include "cuboid_mapping/io/file_replacement.h"
#include "cuboid_mapping/io/native_format.h"
#include "cuboid_mapping/io/text.h"
#include "map_content.h"
#include "mpi_checkpoint.h"
#include "progress_bar.h"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <iomanip>
#include <iostream>
#include <limits>
#include <memory>
#include <optional>
#include <stdexcept>
#include <utility>

namespace cuboid_mapping_ros {
namespace {

using Clock = std::chrono::steady_clock;
using cuboid_mapping::counted;
using cuboid_mapping::MapSnapshot;

constexpr char kProgram[] = "bag_to_map_mpi";
/// Between two lines that say how far it has come: under mpirun there is no terminal to draw on.
constexpr std::chrono::seconds kProgressPeriod{5};

double secondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

struct Options {
  BagOptions bags;
  double checkpoint_period_s = 0.0;
};

/// What the map depends on: a run goes on only from one with the same.
std::string describeRun(const BagOptions& options) {
  std::string run;
  for (const std::string& bag : options.bags) {
    std::error_code error;
    run += bag + ' ' + std::to_string(std::filesystem::file_size(bag, error)) + '\n';
  }
  for (const std::string& topic : options.topics) run += "topic " + topic + '\n';
  for (const std::string& setting : options.settings) run += "set " + setting + '\n';
  if (!options.parameter_file.empty()) {
    run += cuboid_mapping::readFile(options.parameter_file);
  }
  return run;
}

/// Keeps ranks from saying what rank 0 says, too.
class Silence {
 public:
  explicit Silence(bool is_silent) : is_silent_(is_silent) { set(is_silent); }
  ~Silence() { set(false); }
  Silence(const Silence&) = delete;
  Silence& operator=(const Silence&) = delete;

 private:
  void set(bool is_silent) const {
    if (!is_silent_) return;
    for (std::ostream* stream : {&std::cout, &std::cerr}) {
      stream->clear(is_silent ? std::ios::failbit : std::ios::goodbit);
    }
  }

  bool is_silent_;
};

/// Thrown when all ranks know that it ends here, and rank 0 says why.
struct EndOfAll {
  int status;
  std::string error;  ///< Empty: it has been said.
};

/// The clouds, opened by rank 0 first: what is wrong with the options it alone has to say.
std::unique_ptr<BagClouds> openClouds(const MpiRanks& ranks, const BagOptions& options,
                                      const MpiCheckpoint& checkpoint) {
  std::unique_ptr<BagClouds> clouds;
  std::string error;
  if (ranks.rank() == 0) {
    try {
      (void)checkOutput(options);
      clouds = std::make_unique<BagClouds>(kProgram, options);
      if (clouds->parameters().forget_after_s > 0.0) {
        throw std::runtime_error(
            "bag_to_map_mpi cannot forget: set forget_after to 0, or use bag_to_map");
      }
      if (clouds->parameters().moving_points == MovingPoints::kLeaveOut) {
        throw std::runtime_error(
            "bag_to_map_mpi cannot leave moving points out: set moving_points to ignore, or use "
            "bag_to_map");
      }
      if (clouds->parameters().window.isOn()) {
        throw std::runtime_error(
            "bag_to_map_mpi has no window: set window/frame to \"\", or use bag_to_map");
      }
      error = checkpoint.findFault();
    } catch (const std::exception& exception) {
      error = exception.what();
    }
  }
  if (!ranks.isSaidByFirst(error.empty())) throw EndOfAll{1, error};
  const Silence silence(ranks.rank() != 0);
  if (!clouds) clouds = std::make_unique<BagClouds>(kProgram, options);
  if (clouds->parameters().threads == 0) {
    clouds->setThreads(std::max(1, numThreads(clouds->parameters()) / ranks.sizeOnThisMachine()));
  }
  return clouds;
}

/// Of rank 0, on stderr.
cuboid_mapping::ProgressListener tellProgress(const MpiRanks& ranks) {
  if (ranks.rank() != 0) return {};
  const auto start = Clock::now();
  return [start, last = start](std::uint64_t done, std::uint64_t total) mutable {
    if (Clock::now() - last < kProgressPeriod) return;
    last = Clock::now();
    std::cerr << kProgram << ": "
              << cuboid_mapping::formatProgress({done, total, secondsSince(start)}, "clouds")
              << std::endl;
  };
}

/// What all ranks have left out; the text of the first rank that has one.
LeftOutClouds gatherLeftOut(const MpiRanks& ranks, const LeftOutClouds& own) {
  LeftOutClouds all;
  const auto counts = ranks.sum({own.counts.begin(), own.counts.end()});
  std::copy(counts.begin(), counts.end(), all.counts.begin());
  for (std::size_t i = 0; i < kNumDropReasons; ++i) {
    if (all.counts[i] == 0) continue;
    std::vector<std::string> to(static_cast<std::size_t>(ranks.size()));
    to.front() = own.first_texts[i];
    for (const std::string& text : ranks.exchange(to)) {
      if (all.first_texts[i].empty()) all.first_texts[i] = text;
    }
  }
  return all;
}

MapSnapshot takeOwnPart(const BagClouds& clouds, const BrickOwner& owner) {
  const cuboid_mapping::MapConfig& config = clouds.parameters().map;
  MapSnapshot map{config.resolution_m,
                  config.sensor_model,
                  config.environment,
                  withoutSlash(clouds.parameters().frame_id),
                  {}};
  owner.voxels().forEach(
      [&map](const cuboid_mapping::VoxelBrick& brick) { map.bricks.push_back(brick); });
  cuboid_mapping::sortBricks(map.bricks);
  return map;
}

/// How far all have come, in this run and the ones before.
MpiProgress gatherProgress(const MpiRanks& ranks, const BagClouds& clouds, const BrickOwner& owner,
                           const MpiProgress& before) {
  MpiProgress progress{before.num_rounds, {}, gatherLeftOut(ranks, clouds.leftOut())};
  const NodeStatistics& own = clouds.statistics();
  progress.sums =
      ranks.sum({own.num_received, own.num_inserted, own.num_points, owner.numSentBytes()});
  for (std::size_t i = 0; i < before.sums.size(); ++i) progress.sums[i] += before.sums[i];
  for (std::size_t i = 0; i < kNumDropReasons; ++i) {
    progress.left_out.counts[i] += before.left_out.counts[i];
    const std::string& text = before.left_out.first_texts[i];
    if (!text.empty()) progress.left_out.first_texts[i] = text;
  }
  return progress;
}

/// @return How far all have come at the end.
MpiProgress walkAll(const MpiRanks& ranks, BagClouds& clouds, BrickOwner& owner,
                    MpiCheckpoint& checkpoint) {
  const auto size = static_cast<std::uint64_t>(ranks.size());
  const std::uint64_t clouds_of_round = size * BrickOwner::kCloudsOfRound;
  const std::uint64_t num_rounds = (clouds.numClouds() + clouds_of_round - 1) / clouds_of_round;
  const MpiProgress before = checkpoint.resume(owner);
  const std::uint64_t num_before = before.num_rounds * clouds_of_round;
  if (num_before > 0 && ranks.rank() == 0) {
    std::cerr << kProgram << ": goes on after " << counted(num_before, "cloud") << std::endl;
  }
  std::uint64_t num_done = before.num_rounds;
  const auto end_round = [&] {
    owner.exchange();
    ++num_done;
    if (!checkpoint.isDue()) return;
    MpiProgress progress = gatherProgress(ranks, clouds, owner, before);
    progress.num_rounds = num_done;
    checkpoint.write(progress, takeOwnPart(clouds, owner));
  };
  const auto take = [&](const cuboid_mapping::ScanUpdate* update, const BagClouds::Origin& origin) {
    if (owner.add(update, origin.source)) end_round();
  };
  clouds.walk({static_cast<std::uint64_t>(ranks.rank()), size, num_before}, take,
              tellProgress(ranks));
  while (num_done < num_rounds) end_round();
  return gatherProgress(ranks, clouds, owner, before);
}

/// The whole map, at rank 0; nothing elsewhere.
std::optional<MapSnapshot> gatherMap(const MpiRanks& ranks, MapSnapshot part) {
  if (ranks.rank() != 0) {
    ranks.sendToFirst(toNativeFormat(part));
    return std::nullopt;
  }
  const cuboid_mapping::SnapshotLimits no_limits{std::numeric_limits<std::size_t>::max() / 8,
                                                 std::numeric_limits<std::uint64_t>::max() / 8};
  for (int rank = 1; rank < ranks.size(); ++rank) {
    MapSnapshot other = cuboid_mapping::fromNativeFormat(ranks.receive(rank), no_limits);
    std::move(other.bricks.begin(), other.bricks.end(), std::back_inserter(part.bricks));
  }
  cuboid_mapping::sortBricks(part.bricks);
  return part;
}

int makeMap(const MpiRanks& ranks, const Options& options) {
  const auto start = Clock::now();
  MpiCheckpoint checkpoint(ranks, options.bags.output, describeRun(options.bags),
                           options.checkpoint_period_s);
  const std::unique_ptr<BagClouds> clouds = openClouds(ranks, options.bags, checkpoint);
  std::vector<cuboid_mapping::SensorModel> models;
  for (std::size_t i = 0; i < sourcesOf(clouds->parameters()).size(); ++i) {
    models.push_back(clouds->sensorModel(i));
  }
  BrickOwner owner(ranks, models, makeMapConfig(clouds->parameters()).threads);
  const MpiProgress progress = walkAll(ranks, *clouds, owner, checkpoint);
  const double time_s = secondsSince(start);
  if (ranks.rank() == 0) clouds->report(progress.left_out);
  const std::vector<std::uint64_t>& sums = progress.sums;
  const double exchange_s = ranks.greatest(owner.exchangeTime_s());
  if (sums[1] == 0) {
    throw EndOfAll{1,
                   "none of " + counted(sums[0], "cloud") + " could be used: nothing was written"};
  }
  const auto map = gatherMap(ranks, takeOwnPart(*clouds, owner));
  if (!map) return 0;
  const std::string& output = options.bags.output;
  const std::size_t num_bytes = cuboid_mapping::writeMapFile(output, *map);
  checkpoint.remove();
  std::cout << std::fixed << std::setprecision(1) << output << ": " << sums[1] << " of "
            << counted(sums[0], "cloud") << ", " << counted(sums[2], "point") << ", "
            << describeContent(*map, *cuboid_mapping::formatOfName(output)) << ", " << num_bytes
            << " bytes, in " << secondsSince(start) << " s; "
            << counted(static_cast<std::uint64_t>(ranks.size()), "rank") << ", which sent "
            << 1e-3 * static_cast<double>(sums[3]) / static_cast<double>(sums[1])
            << " kB a cloud and waited for each other " << 100.0 * exchange_s / time_s
            << " % of the time at most" << std::endl;
  return 0;
}

/// The same at all ranks.
Options readOptions(const MpiRanks& ranks, int argc, char** argv) {
  const Silence silence(ranks.rank() != 0);
  Options options;
  cuboid_mapping::CommandLine line(
      kProgram,
      "bag_to_map on several processes and machines: mpirun -n N bag_to_map_mpi BAG... -o FILE.\n"
      "The file is the same, byte for byte, whatever N.");
  line.addNumber(
      "checkpoint", options.checkpoint_period_s,
      "seconds after which the state of all ranks is written beside the output, so that the "
      "same command goes on from there; 0: never",
      {0.0, 1e6});
  try {
    if (const auto status = parseBagOptions(line, argc, argv, options.bags))
      throw EndOfAll{*status, ""};
  } catch (const std::exception& exception) {
    throw EndOfAll{1, exception.what()};
  }
  return options;
}

/// What one rank alone does not survive ends the others, too.
int runRank(int argc, char** argv) {
  MpiRanks ranks(argc, argv);
  const std::string name =
      ranks.size() == 1 ? kProgram : kProgram + (", rank " + std::to_string(ranks.rank()));
  bool is_end_of_all = false;
  cuboid_mapping::catchInterrupts();
  const int status = cuboid_mapping::runProgram(name, [&] {
    try {
      return makeMap(ranks, readOptions(ranks, argc, argv));
    } catch (const EndOfAll& end) {
      is_end_of_all = true;
      if (ranks.rank() == 0 && !end.error.empty()) {
        std::cerr << kProgram << ": " << end.error << std::endl;
      }
      return end.status;
    }
  });
  if (status != 0 && !is_end_of_all) MpiRanks::abort(status);
  return status;
}

}  // namespace
}  // namespace cuboid_mapping_ros

int main(int argc, char** argv) { return cuboid_mapping_ros::runRank(argc, argv); }
