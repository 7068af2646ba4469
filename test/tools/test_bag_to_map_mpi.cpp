// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/io/map_files.h"
#include "run_program.h"

#include <gtest/gtest.h>

#include <cstdlib>

namespace cuboid_mapping {
namespace {

using test::Program;
using test::ProgramEnd;
using test::readText;
using test::runProgram;
using test::TemporaryFolder;

/// Allows more ranks than cores, and root, which mpirun refuses by default. Ranks that wait leave their core to others.
void allowMpi() {
  setenv("OMPI_MCA_rmaps_base_oversubscribe", "1", 1);
  setenv("PRTE_MCA_rmaps_default_mapping_policy", ":oversubscribe", 1);  // Of Open MPI 5.
  setenv("OMPI_MCA_mpi_yield_when_idle", "1", 1);
  setenv("OMPI_ALLOW_RUN_AS_ROOT", "1", 1);
  setenv("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1", 1);
}

using Words = std::vector<std::string>;

Words operator+(Words words, const Words& more) {
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

Words commandOf(int ranks, const Words& arguments) {
  return Words{MPIRUN_PROGRAM, "-n", std::to_string(ranks), BAG_TO_MAP_MPI_PROGRAM} + arguments;
}

ProgramEnd runRanks(int ranks, const Words& arguments) {
  return runProgram(commandOf(ranks, arguments), allowMpi);
}

std::size_t countOf(const std::string& part, const std::string& text) {
  std::size_t count = 0;
  for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

class BagToMapMpi : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder = new TemporaryFolder();
    bag = *folder / "drive.bag";
    ASSERT_EQ(runProgram({SIMULATED_LIDAR_PROGRAM, "--bag", bag, "--duration", "3"}).status, 0);
  }
  static void TearDownTestSuite() {
    delete folder;
    folder = nullptr;
  }

  /// Expects the bytes of bag_to_map with any number of ranks.
  static void expectSameBytes(const std::string& bags, const Words& options,
                              const std::string& ending = "cuboids", bool has_cuboids = false) {
    const std::string one = *folder / ("one." + ending);
    const ProgramEnd end_of_one = runProgram(Words{BAG_TO_MAP_PROGRAM, bags, "-o", one} + options);
    ASSERT_EQ(end_of_one.status, 0) << end_of_one.err;
    if (has_cuboids) {  // Ranks do not fuse.
      MapSnapshot snapshot = readMapFile(one).snapshot;
      EXPECT_FALSE(snapshot.cuboids.empty());
      snapshot.cuboids.clear();
      (void)writeMapFile(one, snapshot);
    }
    for (const int ranks : {1, 2, 3, 4, 8}) {
      const std::string many = *folder / ("many." + ending);
      const ProgramEnd end = runRanks(ranks, Words{bags, "-o", many} + options);
      ASSERT_EQ(end.status, 0) << end.err;
      EXPECT_GT(readText(one).size(), 1000U);
      EXPECT_TRUE(readText(one) == readText(many)) << ranks << " ranks: " << end.out;
      std::filesystem::remove(many);
    }
  }

  static TemporaryFolder* folder;
  static std::string bag;
};

TemporaryFolder* BagToMapMpi::folder = nullptr;
std::string BagToMapMpi::bag;

TEST_F(BagToMapMpi, givesTheBytesOfBagToMapWhateverTheRanks) {
  expectSameBytes(bag, {"--set", "resolution=0.1"});
  expectSameBytes(bag,
                  {"--set", "resolution=0.2", "environment=static", "fusion=growth",
                   "sensor_model/max_range=8", "sensor_model/hit=0.8"},
                  "cuboids", true);
  expectSameBytes(bag, {"--set", "resolution=0.2", "filter_ground=true", "base_frame_id=base_link"},
                  "bt");
  expectSameBytes(bag, {"--set", "resolution=0.1"}, "sqlite");
}

TEST_F(BagToMapMpi, givesTheSameBytesOfRealScans) {
  const char* data = std::getenv("CUBOID_DATA_DIR");
  if (data == nullptr) GTEST_SKIP() << "CUBOID_DATA_DIR is not set";
  const std::string folder_of_scans = std::string(data) + "/kitti_0005_city";
  expectSameBytes(folder_of_scans, {"--set", "resolution=0.2"});
}

/// Limits the data of a process, without shared memory.
std::function<void()> allowMpiWithin(std::size_t size_bytes) {
  return [size_bytes] {
    allowMpi();
    const rlimit limit{size_bytes, size_bytes};
    setrlimit(RLIMIT_DATA, &limit);
  };
}

TEST_F(BagToMapMpi, writesAStoreOfAMapThatNoRankCouldHold) {
  const std::string lap = *folder / "lap.bag";
  ASSERT_EQ(
      runProgram({SIMULATED_LIDAR_PROGRAM, "--bag", lap, "--duration", "72", "--cloud-rate", "0.5"})
          .status,
      0);
  const std::string store = *folder / "large.sqlite";
  const Words arguments{lap, "-o", store, "--set", "resolution=0.025", "threads=1"};
  ASSERT_EQ(runProgram(Words{BAG_TO_MAP_PROGRAM} + arguments).status, 0);
  const std::string whole = readText(store);
  std::filesystem::remove(store);
  // One rank needs 170 MB, one of eight 90 MB.
  const auto limited = allowMpiWithin(std::size_t{128} << 20);
  const ProgramEnd one = runProgram(commandOf(1, arguments), limited);
  EXPECT_NE(one.status, 0);
  EXPECT_NE(one.err.find("out of memory"), std::string::npos) << one.err;
  EXPECT_FALSE(std::filesystem::exists(store));
  const ProgramEnd many = runProgram(commandOf(8, arguments), limited);
  EXPECT_EQ(many.status, 0) << many.err;
  EXPECT_TRUE(whole == readText(store));
}

TEST_F(BagToMapMpi, someRanksMayHaveNoCloud) {
  const std::string short_bag = *folder / "short.bag";
  ASSERT_EQ(runProgram({SIMULATED_LIDAR_PROGRAM, "--bag", short_bag, "--duration", "0.2"}).status,
            0);
  expectSameBytes(short_bag, {"--set", "resolution=0.2"});
}

TEST_F(BagToMapMpi, saysOnceWhatIsWrong) {
  const std::string map = *folder / "none.cuboids";
  std::filesystem::create_directory(*folder / "no_scans");
  const std::string mars = "frame_id=mars";
  struct Case {
    Words arguments;
    std::string text;
  };
  for (const Case& wrong :
       {Case{{*folder / "no.bag", "-o", map}, "cannot read"},
        Case{{*folder / "no_scans", "-o", map}, "is neither a folder of scans"},
        Case{{bag, "-o", map, "--set", "resolutoin=1"}, "resolutoin"},
        Case{{bag, "-o", map, "--topic", "/no"}, "the bags have no topic /no"},
        Case{{bag, "-o", *folder / "no/map.cuboids"}, "cannot write"},
        Case{{bag, "-o", map, "--set", mars}, "could be used: nothing was written"}}) {
    const ProgramEnd end = runRanks(3, wrong.arguments);
    EXPECT_NE(end.status, 0);
    EXPECT_EQ(countOf(wrong.text, end.err), 1U) << end.err;
    EXPECT_FALSE(std::filesystem::exists(map));
  }
  const ProgramEnd end = runRanks(3, {bag, "-o", map, "--set", mars});
  EXPECT_EQ(countOf("30 clouds dropped, no transform", end.err), 1U) << end.err;
}

/// Makes every fifth message of a bag unreadable: clouds, and poses, which all ranks read.
void damage(const std::string& bag, const std::string& damaged) {
  const std::string head("op=\x02\x0d\0\0\0time=", 13);  // In the record of a message.
  std::string bytes = readText(bag);
  std::size_t count = 0;
  for (auto at = bytes.find(head); at != std::string::npos; at = bytes.find(head, at + 1)) {
    if (count++ % 5 == 3) bytes[at] = 'x';
  }
  std::ofstream(damaged, std::ios::binary) << bytes;
}

TEST_F(BagToMapMpi, reportsWhatAnyRankLeavesOut) {
  const std::string damaged = *folder / "damaged.bag";
  damage(bag, damaged);
  const Words arguments{damaged, "-o", *folder / "damaged.cuboids", "--set",
                        "sensor_model/min_range=3"};
  const std::string all = runProgram(Words{BAG_TO_MAP_PROGRAM} + arguments).err;
  EXPECT_EQ(countOf("is damaged: ", all), 1U) << all;
  EXPECT_EQ(countOf("% of the points left out", all), 1U) << all;
  for (const int ranks : {1, 2, 3}) {
    const ProgramEnd end = runRanks(ranks, arguments);
    for (const std::string part : {"is damaged: ", "% of the points left out"}) {
      const auto line_of = [&part](const std::string& text) {
        const std::size_t begin = text.rfind(": ", text.find(part) - 1);
        return text.substr(begin, text.find('\n', begin) - begin);
      };
      EXPECT_EQ(countOf(line_of(all), end.err), 1U) << all << end.err;
    }
  }
}

/// The child processes of a process, by the name of their program.
std::vector<pid_t> childrenOf(pid_t parent, const std::string& name) {
  std::vector<pid_t> children;
  for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
    const std::string stat = readText(entry.path() / "stat");
    const std::size_t end = stat.rfind(')');
    if (end == std::string::npos || stat.find('(' + name) == std::string::npos) continue;
    if (std::stoi(stat.substr(end + 4)) == parent) children.push_back(std::stoi(stat));
  }
  return children;
}

TEST_F(BagToMapMpi, waitsForSlowRanks) {
  const Words settings{"--set", "resolution=0.05", "threads=1"};
  const std::string one = *folder / "one.cuboids";
  const std::string map = *folder / "slow.cuboids";
  ASSERT_EQ(runProgram(Words{BAG_TO_MAP_PROGRAM, bag, "-o", one} + settings).status, 0);
  Program run(commandOf(3, Words{bag, "-o", map} + settings), allowMpi);
  int num_stops = 0;
  for (int i = 0; i < 100 && !std::filesystem::exists(map); ++i) {
    for (const pid_t rank : childrenOf(run.pid(), "bag_to_map_mpi")) {
      kill(rank, SIGSTOP);
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
      kill(rank, SIGCONT);
      ++num_stops;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  const ProgramEnd end = run.finish();
  EXPECT_EQ(end.status, 0) << end.err;
  EXPECT_GT(num_stops, 3);
  EXPECT_TRUE(readText(one) == readText(map));
}

/// A long run whose ranks are all there and handle signals.
class LongRun {
 public:
  LongRun(const std::string& bag, std::string map)
      : map_(std::move(map)),
        program_(commandOf(3, {bag, "-o", map_, "--set", "resolution=0.01", "threads=1"}),
                 allowMpi) {
    for (int i = 0; i < 3000 && !areAllThere(); ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    EXPECT_TRUE(areAllThere());
  }

  [[nodiscard]] std::vector<pid_t> ranks() const {
    return childrenOf(program_.pid(), "bag_to_map_mpi");
  }
  [[nodiscard]] Program& program() { return program_; }
  [[nodiscard]] bool hasWritten() const { return std::filesystem::exists(map_); }

 private:
  [[nodiscard]] bool areAllThere() const {
    const std::vector<pid_t> all = ranks();
    return all.size() == 3 && std::all_of(all.begin(), all.end(), [](pid_t pid) {
             return (test::caughtSignals(pid).value_or(0) >> (SIGTERM - 1) & 1U) != 0;
           });
  }

  std::string map_;
  Program program_;
};

TEST_F(BagToMapMpi, saysThatARankHasDiedAndWritesNothing) {
  LongRun run(bag, *folder / "dead.cuboids");
  kill(run.ranks()[1], SIGKILL);
  const ProgramEnd end = run.program().finish();
  EXPECT_NE(end.status, 0);
  EXPECT_NE(end.err.find("signal 9"), std::string::npos) << end.err;
  EXPECT_FALSE(run.hasWritten());
}

TEST_F(BagToMapMpi, goesOnFromACheckpointAfterARankHasDied) {
  const Words settings{"--set", "resolution=0.02", "threads=1", "frame_id=map"};
  const std::string map = *folder / "again.cuboids";
  const std::string checkpoint = map + ".checkpoint";
  const Words again = Words{bag, "-o", map, "--checkpoint", "0.001"} + settings;
  {
    Program run(commandOf(3, again), allowMpi);
    for (int i = 0; i < 60000 && !std::filesystem::exists(checkpoint + "/index.json"); ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    const std::vector<pid_t> ranks = childrenOf(run.pid(), "bag_to_map_mpi");
    ASSERT_EQ(ranks.size(), 3U);
    kill(ranks[1], SIGKILL);
    EXPECT_NE(run.finish().status, 0);
  }
  EXPECT_FALSE(std::filesystem::exists(map));
  ASSERT_TRUE(std::filesystem::exists(checkpoint));
  const ProgramEnd fewer = runRanks(2, again);
  EXPECT_NE(fewer.status, 0);
  EXPECT_EQ(countOf("is of 3 ranks", fewer.err), 1U) << fewer.err;
  for (const Words& more : {Words{"--set", "sensor_model/max_range=5"},
                            Words{"--transform", "base_link lidar 0 0 2 0 0 0"}}) {
    const ProgramEnd other = runRanks(3, again + more);
    EXPECT_NE(other.status, 0);
    EXPECT_EQ(countOf("other bags or settings", other.err), 1U) << more[0] << other.err;
  }

  const ProgramEnd end = runRanks(3, again);
  EXPECT_EQ(end.status, 0) << end.err;
  EXPECT_EQ(countOf("goes on after", end.err), 1U) << end.err;
  EXPECT_NE(end.out.find("30 of 30 clouds"), std::string::npos) << end.out;
  EXPECT_FALSE(std::filesystem::exists(checkpoint));
  const std::string one = *folder / "one.cuboids";
  ASSERT_EQ(runProgram(Words{BAG_TO_MAP_PROGRAM, bag, "-o", one} + settings).status, 0);
  EXPECT_TRUE(readText(one) == readText(map));
}

TEST_F(BagToMapMpi, endsOnCtrlCAndWritesNothing) {
  LongRun run(bag, *folder / "interrupted.cuboids");
  run.program().send(SIGINT);
  const ProgramEnd end = run.program().finish();
  EXPECT_NE(end.status, 0);
  EXPECT_FALSE(run.hasWritten());
  EXPECT_TRUE(run.ranks().empty());
}

}  // namespace
}  // namespace cuboid_mapping
