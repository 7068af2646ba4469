// SPDX-License-Identifier: BSD-3-Clause
// Kills a process that writes to a store, again and again. CUBOID_MAPPING_KILLS sets how often.
#include "cuboid_mapping/io/map_store.h"

#include "support/random.h"
#include "tools/run_program.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <iostream>

namespace cuboid_mapping {
namespace {

using test::Random;
using test::TemporaryFolder;

const std::vector<Cell> kPages = {{0, 0, 0}, {64, 0, 0}, {-64, 0, 0}, {0, -64, 64}};

/// Content of a page after a transaction: noise, and the number of the transaction in the first voxel.
std::vector<VoxelBrick> contentOf(const Cell& page, int transaction) {
  std::vector<VoxelBrick> bricks;
  std::uint64_t noise = static_cast<std::uint64_t>(transaction) * 977U + CellHash()(page);
  for (int i = 0; i < 6; ++i) {
    VoxelValues values{};
    for (float& value : values) {
      noise = noise * 6364136223846793005ULL + 1442695040888963407ULL;
      value = static_cast<float>(noise >> 58) - 32.0F;
    }
    values[0] = static_cast<float>(transaction);
    bricks.push_back({page + Cell{8 * i, 0, 0}, PackedVoxels(BrickMask::all(), values)});
  }
  sortBricks(bricks);
  return bricks;
}

/// Report of the writer after each transaction.
struct Report {
  int transaction = 0;
  std::uint64_t log_bytes = 0;  ///< Bytes of the write-ahead log that are on the disk.
};

/// Writes until it is killed.
[[noreturn]] void writeForever(const std::string& file, int first, int reports) {
  MapSnapshot head;
  head.frame_id = "map";
  const auto store = openStoreOf(head, file);
  for (int transaction = first;; ++transaction) {
    store->write(kPages, [&](const Cell& page) { return contentOf(page, transaction); });
    const Report report{transaction, std::filesystem::file_size(file + "-wal")};
    if (write(reports, &report, sizeof(report)) != sizeof(report)) _exit(1);
  }
}

/// Starts a writing process, and kills it after some time. @return Its last report.
Report writeAndKill(const std::string& file, int first, int time_us) {
  int pipe_ends[2];
  if (pipe(pipe_ends) != 0) throw std::runtime_error("no pipe");
  const pid_t pid = fork();
  if (pid == 0) writeForever(file, first, pipe_ends[1]);
  close(pipe_ends[1]);
  usleep(static_cast<useconds_t>(time_us));
  kill(pid, SIGKILL);
  int state = 0;
  waitpid(pid, &state, 0);
  Report last;
  last.transaction = first - 1;
  for (Report report; read(pipe_ends[0], &report, sizeof(report)) == sizeof(report);) last = report;
  close(pipe_ends[0]);
  return last;
}

/// Damages the log as a power failure may: only synchronized bytes are sure to be on the disk.
void damageUnsyncedLog(const std::string& log, std::uint64_t num_sure, Random& random) {
  std::error_code error;
  const std::uint64_t size = std::filesystem::file_size(log, error);
  if (error || size <= num_sure) return;
  const auto span = static_cast<int>(size - num_sure);
  if (random.chance(0.5)) {
    std::filesystem::resize_file(log,
                                 num_sure + static_cast<std::uint64_t>(random.integer(0, span)));
    return;
  }
  std::fstream bytes(log, std::ios::in | std::ios::out | std::ios::binary);
  for (int i = 0; i < 64; ++i) {
    bytes.seekp(static_cast<std::streamoff>(num_sure) + random.integer(0, span - 1));
    bytes.put(static_cast<char>(random.integer(0, 255)));
  }
}

/// The transaction of all pages.
int findTransaction(const std::string& file) {
  const MapStore store(file, StoreAccess::kWrite);
  int transaction = 0;
  for (const Cell& page : kPages) {
    const std::vector<VoxelBrick> bricks = store.read(page);  // Throws for a damaged page.
    const int found = bricks.empty() ? 0 : static_cast<int>(*bricks.front().voxels.logOddsAt(0));
    if (page == kPages.front()) transaction = found;
    EXPECT_EQ(found, transaction) << "pages of two transactions";
    const std::vector<VoxelBrick> expected = contentOf(page, found);
    EXPECT_EQ(bricks.size(), found == 0 ? 0 : expected.size());
    for (std::size_t i = 0; i < bricks.size(); ++i) EXPECT_EQ(bricks[i].voxels, expected[i].voxels);
  }
  return transaction;
}

TEST(StoreKills, leaveWholeTransactionsAndAllThatWereDone) {
  const char* text = std::getenv("CUBOID_MAPPING_KILLS");
  const int num_kills = text != nullptr ? std::atoi(text) : 6;
  const TemporaryFolder folder;
  const std::string file = folder / "map.sqlite";
  Random random(821);
  int transaction = 0;
  int num_more = 0;
  int longest_us = 120000;
  for (int i = 0; i < num_kills; ++i) {
    const bool is_plug = i % 2 == 1;
    const int first = transaction + 1;
    const Report last = writeAndKill(file, first, random.integer(0, longest_us));
    if (last.transaction < first) longest_us *= 2;  // Slow machines have written nothing by then.
    if (is_plug && last.transaction >= first) {
      damageUnsyncedLog(file + "-wal", last.log_bytes, random);
    }
    transaction = findTransaction(file);
    EXPECT_GE(transaction, last.transaction) << test::seedNote(static_cast<std::size_t>(i));
    num_more += transaction > last.transaction ? 1 : 0;
    if (testing::Test::HasFailure()) return;
  }
  std::cout << num_kills << " kills, " << transaction << " transactions; " << num_more
            << " times one more was whole than the writer had said" << std::endl;
  EXPECT_GT(transaction, 0);
}

}  // namespace
}  // namespace cuboid_mapping
