// SPDX-License-Identifier: BSD-3-Clause
// bag_to_map on several processes and machines: mpirun -n N bag_to_map_mpi BAG... -o FILE
#include "bag_clouds.h"
#include "brick_owner.h"
#include "cuboid_mapping/io/native_format.h"
#include "cuboid_mapping/io/text.h"
#include "map_content.h"
#include "progress_bar.h"

#include <algorithm>
#include <chrono>
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
std::unique_ptr<BagClouds> openClouds(const MpiRanks& ranks, const BagOptions& options) {
  std::unique_ptr<BagClouds> clouds;
  std::string error;
  if (ranks.rank() == 0) {
    try {
      (void)checkOutput(options);
      clouds = std::make_unique<BagClouds>(kProgram, options);
      if (clouds->parameters().forget_after_s > 0.0) {
        throw std::runtime_error("bag_to_map_mpi cannot forget: set forget_after to 0, or use bag_to_map");
      }
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

void walkAll(const MpiRanks& ranks, BagClouds& clouds, BrickOwner& owner) {
  const auto size = static_cast<std::uint64_t>(ranks.size());
  const std::uint64_t clouds_of_round = size * BrickOwner::kCloudsOfRound;
  const std::uint64_t num_rounds = (clouds.numClouds() + clouds_of_round - 1) / clouds_of_round;
  std::uint64_t num_done = 0;
  const auto take = [&](const cuboid_mapping::ScanUpdate* update, const BagClouds::Origin& origin) {
    if (!owner.add(update, origin.source)) return;
    owner.exchange();
    ++num_done;
  };
  clouds.walk({static_cast<std::uint64_t>(ranks.rank()), size}, take, tellProgress(ranks));
  for (; num_done < num_rounds; ++num_done) owner.exchange();
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

int makeMap(const MpiRanks& ranks, const BagOptions& options) {
  const auto start = Clock::now();
  const std::unique_ptr<BagClouds> clouds = openClouds(ranks, options);
  std::vector<cuboid_mapping::SensorModel> models;
  for (std::size_t i = 0; i < sourcesOf(clouds->parameters()).size(); ++i) {
    models.push_back(clouds->sensorModel(i));
  }
  BrickOwner owner(ranks, models, makeMapConfig(clouds->parameters()).threads);
  walkAll(ranks, *clouds, owner);
  const double time_s = secondsSince(start);
  const LeftOutClouds left_out = gatherLeftOut(ranks, clouds->leftOut());
  if (ranks.rank() == 0) clouds->report(left_out);
  const NodeStatistics& own = clouds->statistics();
  const std::vector<std::uint64_t> sums =
      ranks.sum({own.num_received, own.num_inserted, own.num_points, owner.numSentBytes()});
  const double exchange_s = ranks.greatest(owner.exchangeTime_s());
  if (sums[1] == 0) {
    throw EndOfAll{1,
                   "none of " + counted(sums[0], "cloud") + " could be used: nothing was written"};
  }
  const auto map = gatherMap(ranks, takeOwnPart(*clouds, owner));
  if (!map) return 0;
  const std::size_t num_bytes = cuboid_mapping::writeMapFile(options.output, *map);
  std::cout << std::fixed << std::setprecision(1) << options.output << ": " << sums[1] << " of "
            << counted(sums[0], "cloud") << ", " << counted(sums[2], "point") << ", "
            << describeContent(*map, *cuboid_mapping::formatOfName(options.output)) << ", "
            << num_bytes << " bytes, in " << secondsSince(start) << " s; "
            << counted(static_cast<std::uint64_t>(ranks.size()), "rank") << ", which sent "
            << 1e-3 * static_cast<double>(sums[3]) / static_cast<double>(sums[1])
            << " kB a cloud and waited for each other " << 100.0 * exchange_s / time_s
            << " % of the time at most" << std::endl;
  return 0;
}

/// The same at all ranks.
BagOptions readOptions(const MpiRanks& ranks, int argc, char** argv) {
  const Silence silence(ranks.rank() != 0);
  BagOptions options;
  cuboid_mapping::CommandLine line(
      kProgram,
      "bag_to_map on several processes and machines: mpirun -n N bag_to_map_mpi BAG... -o FILE.\n"
      "The file is the same, byte for byte, whatever N.");
  try {
    if (const auto status = parseBagOptions(line, argc, argv, options)) throw EndOfAll{*status, ""};
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
