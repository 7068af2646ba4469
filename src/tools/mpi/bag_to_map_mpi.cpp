// SPDX-License-Identifier: BSD-3-Clause
// bag_to_map on several processes and machines: mpirun -n N bag_to_map_mpi INPUT... -o FILE
#include "bag_clouds.h"
#include "cuboid_mapping/io/file_replacement.h"
#include "cuboid_mapping/io/text.h"
#include "cuboid_mapping/ros/clouds/forgetting.h"
#include "cuboid_mapping/ros/middleware/tf_lookup.h"
#include "map_content.h"
#include "mpi/brick_owner.h"
#include "mpi/mpi_checkpoint.h"
#include "mpi/mpi_output.h"
#include "progress_bar.h"

#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <ctime>
#include <filesystem>
#include <iomanip>
#include <iostream>
#include <memory>
#include <stdexcept>

namespace cuboid_mapping_ros {
namespace {

using Clock = std::chrono::steady_clock;
using cuboid_mapping::counted;
using cuboid_mapping::MapSnapshot;

constexpr char kProgram[] = "bag_to_map_mpi";
/// Time between two lines about the progress: under mpirun there is no terminal for a bar.
constexpr std::chrono::seconds kProgressPeriod{5};

double secondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

struct Options {
  BagOptions bags;
  double checkpoint_period_s = 0.0;
};

/// Settings that determine the map: a run continues only one with the same settings.
std::string describeRun(const BagOptions& options) {
  std::string run;
  for (const std::string& input : options.inputs) {
    std::error_code error;
    const bool is_folder = std::filesystem::is_directory(input, error);
    const std::string file = is_folder ? input + "/poses.txt" : input;
    run += input + ' ' + std::to_string(std::filesystem::file_size(file, error)) + '\n';
  }
  for (const std::string& topic : options.topics) run += "topic " + topic + '\n';
  for (const std::string& setting : options.settings) run += "set " + setting + '\n';
  for (const std::string& text : options.transforms) run += "transform " + text + '\n';
  for (const std::string& text : {options.tf, options.poses, options.poses_of, options.bin_row}) {
    run += "option " + text + '\n';
  }
  for (const std::string& file : {options.poses, options.parameter_file}) {
    std::error_code error;  // Poses may be a topic.
    const bool is_file = std::filesystem::is_regular_file(file, error);
    if (is_file) run += cuboid_mapping::readFile(file);
  }
  return run;
}

/// Silences ranks whose messages rank 0 prints, too.
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

/// Thrown when all ranks know that the run ends here, and rank 0 reports the reason.
struct EndOfAll {
  int status;
  std::string error;  ///< Empty: it has been reported.
};

/// Opens the clouds, first at rank 0, which alone reports errors of the options.
std::unique_ptr<BagClouds> openClouds(const MpiRanks& ranks, const BagOptions& options,
                                      const MpiCheckpoint& checkpoint) {
  std::unique_ptr<BagClouds> clouds;
  std::string error;
  if (ranks.rank() == 0) {
    try {
      (void)cuboid_mapping::checkOutput(options.output);
      clouds = std::make_unique<BagClouds>(kProgram, options);
      if (Forgetting(clouds->parameters()).isOn()) {
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

/// Reports progress to stderr at rank 0.
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

/// The texts of all ranks, at rank 0.
std::vector<std::string> gatherTexts(const MpiRanks& ranks, const std::string& own) {
  std::vector<std::string> to(static_cast<std::size_t>(ranks.size()));
  to.front() = own;
  return ranks.exchange(to);
}

/// Inputs left out by any rank; the text of the first rank that has one.
LeftOutClouds gatherLeftOut(const MpiRanks& ranks, const LeftOutClouds& own) {
  LeftOutClouds all;
  const auto counts = ranks.sum({own.counts.begin(), own.counts.end()});
  std::copy(counts.begin(), counts.end(), all.counts.begin());
  for (std::size_t i = 0; i < kNumDropReasons; ++i) {
    if (all.counts[i] == 0) continue;
    for (const std::string& text : gatherTexts(ranks, own.first_texts[i])) {
      if (all.first_texts[i].empty()) all.first_texts[i] = text;
    }
  }
  return all;
}

/// The map without bricks.
MapSnapshot headOf(const BagClouds& clouds) {
  const cuboid_mapping::MapConfig config = makeMapConfig(clouds.parameters());
  return {config.resolution_m,
          config.sensor_model,
          config.environment,
          withoutSlash(clouds.parameters().frame_id),
          {}};
}

/// Progress of all ranks, in this run and earlier ones.
MpiProgress gatherProgress(const MpiRanks& ranks, const BagClouds& clouds, const BrickOwner& owner,
                           const MpiProgress& before) {
  MpiProgress progress{
      before.num_rounds, {}, gatherLeftOut(ranks, clouds.leftOut()), before.failures};
  for (const std::string& text : gatherTexts(ranks, clouds.failures())) progress.failures += text;
  const NodeStatistics& own = clouds.statistics();
  progress.sums = ranks.sum({own.num_received, own.num_inserted, own.num_points,
                             owner.numSentBytes(), own.num_odd_times, own.num_filtered});
  for (std::size_t i = 0; i < before.sums.size(); ++i) progress.sums[i] += before.sums[i];
  for (std::size_t i = 0; i < kNumDropReasons; ++i) {
    progress.left_out.counts[i] += before.left_out.counts[i];
    const std::string& text = before.left_out.first_texts[i];
    if (!text.empty()) progress.left_out.first_texts[i] = text;
  }
  return progress;
}

/// @return Progress of all ranks at the end.
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
    owner.endRound();
    ++num_done;
    if (!checkpoint.isDue()) return;
    owner.finish();
    MpiProgress progress = gatherProgress(ranks, clouds, owner, before);
    progress.num_rounds = num_done;
    checkpoint.write(progress, takePart(headOf(clouds), owner.voxels()));
  };
  const auto take = [&](const cuboid_mapping::ScanUpdate* update, const BagClouds::Origin& origin) {
    if (owner.add(update, origin.source)) end_round();
  };
  clouds.walk({static_cast<std::uint64_t>(ranks.rank()), size, num_before}, take,
              tellProgress(ranks));
  while (num_done < num_rounds) end_round();
  owner.finish();
  return gatherProgress(ranks, clouds, owner, before);
}

/// Peak memory of this process.
double peakMemoryInMb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return 1.024e-3 * static_cast<double>(usage.ru_maxrss);
}

/// Figures of all ranks.
struct Figures {
  double rounds_s = 0.0;    ///< Time until all clouds are in.
  double exchange_s = 0.0;  ///< Longest time that a rank waited and sent.
  double peak_mb = 0.0;     ///< Largest peak of a rank.
  double part = 0.0;        ///< Largest share of the map in a rank.
  CpuTimes cpu;             ///< Sums over ranks.
  double cpu_s = 0.0;       ///< Sum of everything, from the start to the end of the rounds.
};

/// @param start  Start of this run.
Figures gatherFigures(const MpiRanks& ranks, const BrickOwner& owner, Clock::time_point start) {
  const CpuTimes& own = owner.cpuTimes();
  const double own_cpu_s = static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
  std::vector<std::uint64_t> times_us;
  for (const double time_s : {own.pack_s, own.exchange_s, own.apply_s, own_cpu_s}) {
    times_us.push_back(static_cast<std::uint64_t>(1e6 * time_s));
  }
  times_us = ranks.sum(times_us);
  const auto seconds = [&times_us](std::size_t i) {
    return 1e-6 * static_cast<double>(times_us[i]);
  };
  Figures figures;
  figures.rounds_s = secondsSince(start);
  figures.exchange_s = ranks.greatest(owner.exchangeTime_s());
  figures.cpu = {seconds(0), seconds(1), seconds(2)};
  figures.cpu_s = seconds(3);
  const auto num_bricks = static_cast<double>(ranks.sum({owner.voxels().size()}).front());
  figures.part = ranks.greatest(static_cast<double>(owner.voxels().size())) / num_bricks;
  return figures;
}

void printFigures(const Figures& figures, double time_s, double kb_a_cloud) {
  const CpuTimes& cpu = figures.cpu;
  std::cout << std::setprecision(2) << "sent " << kb_a_cloud
            << " kB a cloud; a rank waited and sent for up to "
            << 100.0 * figures.exchange_s / figures.rounds_s << " % of the time, took up to "
            << figures.peak_mb << " MB, and has up to " << 100.0 * figures.part
            << " % of the map; writing took " << time_s - figures.rounds_s
            << " s\nCPU time of all ranks: "
            << figures.cpu_s - cpu.pack_s - cpu.exchange_s - cpu.apply_s
            << " s to start, read and walk, " << cpu.pack_s << " s to pack and unpack, "
            << cpu.exchange_s << " s to send and wait, " << cpu.apply_s << " s to put into the map"
            << std::endl;
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
  Figures figures = gatherFigures(ranks, owner, start);
  const std::vector<std::uint64_t>& sums = progress.sums;
  if (ranks.rank() == 0) {
    PointCounts points;
    points.num_points = sums[2];
    points.num_odd_times = sums[4];
    points.num_filtered = sums[5];
    clouds->addFailures(progress.failures);
    clouds->report(progress.left_out, points);
  }
  if (sums[1] == 0) {
    throw EndOfAll{1,
                   "none of " + counted(sums[0], "cloud") + " could be used: nothing was written"};
  }
  const std::string& output = options.bags.output;
  const std::string content = writeMapOfAll(ranks, headOf(*clouds), owner.voxels(), output);
  figures.peak_mb = ranks.greatest(peakMemoryInMb());
  if (ranks.rank() != 0) return 0;
  checkpoint.remove();
  const double time_s = secondsSince(start);
  std::cout << std::fixed << std::setprecision(1) << output << ": " << sums[1] << " of "
            << counted(sums[0], "cloud") << ", " << counted(sums[2], "point") << ", " << content
            << ", " << std::filesystem::file_size(output) << " bytes, in " << time_s << " s; "
            << counted(static_cast<std::uint64_t>(ranks.size()), "rank") << ", which ";
  printFigures(figures, time_s, 1e-3 * static_cast<double>(sums[3]) / static_cast<double>(sums[1]));
  return 0;
}

/// Options, the same at all ranks.
Options readOptions(const MpiRanks& ranks, int argc, char** argv) {
  const Silence silence(ranks.rank() != 0);
  Options options;
  cuboid_mapping::CommandLine line(
      kProgram,
      "bag_to_map on several processes and machines: mpirun -n N bag_to_map_mpi INPUT... -o FILE.\n"
      "Every N gives the file of bag_to_map, byte for byte with the same zstd; with fusion=growth "
      "without the fused cuboids,\n"
      "since a rank has a part of the map only.");
  line.addNumber("checkpoint", options.checkpoint_period_s,
                 "seconds between saves of the state of all ranks beside the output, from which "
                 "the same command resumes; 0: never",
                 {0.0, 1e6});
  try {
    if (const auto status = parseBagOptions(line, argc, argv, options.bags))
      throw EndOfAll{*status, ""};
  } catch (const std::exception& exception) {
    throw EndOfAll{1, exception.what()};
  }
  return options;
}

/// Runs a rank. An error that ends one rank ends the others, too.
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
