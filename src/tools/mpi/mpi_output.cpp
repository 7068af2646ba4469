// SPDX-License-Identifier: BSD-3-Clause
#include "mpi/mpi_output.h"

#include "command_line.h"
#include "cuboid_mapping/io/byte_stream.h"
#include "cuboid_mapping/io/file_replacement.h"
#include "cuboid_mapping/io/map_files.h"
#include "cuboid_mapping/io/map_store.h"
#include "cuboid_mapping/io/native_format.h"
#include "cuboid_mapping/io/text.h"
#include "map_content.h"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <utility>
#include <vector>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::Cell;
using cuboid_mapping::MapSnapshot;
using cuboid_mapping::VoxelBrick;
using cuboid_mapping::VoxelStore;

MapSnapshot withBricks(const MapSnapshot& head, std::vector<VoxelBrick> bricks) {
  return {head.resolution_m, head.sensor_model, head.environment, head.frame_id, std::move(bricks)};
}

/// Sorts along the Morton curve, and removes repetitions.
void sortUnique(std::vector<Cell>& pages) {
  std::sort(pages.begin(), pages.end(), cuboid_mapping::isBeforeOnMortonCurve);
  pages.erase(std::unique(pages.begin(), pages.end()), pages.end());
}

std::vector<Cell> findPages(const VoxelStore& part) {
  std::vector<Cell> pages;
  part.forEach([&pages](const VoxelBrick& brick) {
    const Cell page = cuboid_mapping::pageOf(brick.brick);
    if (pages.empty() || pages.back() != page) pages.push_back(page);
  });
  sortUnique(pages);
  return pages;
}

std::vector<VoxelBrick> bricksIn(const VoxelStore& part, const Cell& page) {
  std::vector<VoxelBrick> bricks;
  part.forEachIn(cuboid_mapping::pageBox(page),
                 [&bricks](const VoxelBrick& brick) { bricks.push_back(brick); });
  cuboid_mapping::sortBricks(bricks);
  return bricks;
}

std::string toBytes(const std::vector<Cell>& pages) {
  cuboid_mapping::ByteWriter bytes;
  for (const Cell& page : pages) {
    for (int axis = 0; axis < 3; ++axis) bytes.writeU32(static_cast<std::uint32_t>(page[axis]));
  }
  return bytes.take();
}

std::vector<Cell> pagesOfBytes(const std::string& bytes) {
  cuboid_mapping::ByteReader reader(bytes);
  std::vector<Cell> pages;
  while (reader.numLeft() > 0) {
    Cell page;
    for (int axis = 0; axis < 3; ++axis) page[axis] = static_cast<std::int32_t>(reader.readU32());
    pages.push_back(page);
  }
  return pages;
}

/// Pages in a message: enough to avoid one message per page.
constexpr std::size_t kPagesOfMessage = 32;

/// Sends the rank's pages, some at a time.
void sendPages(const MpiRanks& ranks, const MapSnapshot& head, const VoxelStore& part,
               const std::vector<Cell>& pages) {
  for (std::size_t first = 0; first < pages.size(); first += kPagesOfMessage) {
    cuboid_mapping::throwIfInterrupted();
    std::vector<VoxelBrick> bricks;
    const std::size_t end = std::min(first + kPagesOfMessage, pages.size());
    for (std::size_t i = first; i < end; ++i) {
      for (VoxelBrick& brick : bricksIn(part, pages[i])) bricks.push_back(std::move(brick));
    }
    ranks.sendToFirst(toNativeFormat(withBricks(head, std::move(bricks))));
  }
}

/// Pages that a rank sends to rank 0 by sendPages(), and their bricks.
class PagesOfRank {
 public:
  /// @param pages  All pages of the rank, along the Morton curve.
  PagesOfRank(int rank, std::vector<Cell> pages) : rank_(rank), pages_(std::move(pages)) {}

  [[nodiscard]] const std::vector<Cell>& pages() const { return pages_; }

  /// Appends the rank's bricks of a page, if it is the rank's next one.
  void take(const MpiRanks& ranks, const Cell& page, std::vector<VoxelBrick>& bricks) {
    if (next_ == pages_.size() || pages_[next_] != page) return;
    if (next_ % kPagesOfMessage == 0) {
      bricks_ = cuboid_mapping::fromNativeFormat(ranks.receive(rank_),
                                                 cuboid_mapping::SnapshotLimits::none())
                    .bricks;
      next_brick_ = 0;
    }
    ++next_;
    for (; next_brick_ < bricks_.size(); ++next_brick_) {
      VoxelBrick& brick = bricks_[next_brick_];
      if (cuboid_mapping::pageOf(brick.brick) != page) return;
      bricks.push_back(std::move(brick));
    }
  }

 private:
  int rank_;
  std::vector<Cell> pages_;
  std::size_t next_ = 0;
  std::vector<VoxelBrick> bricks_;  ///< Bricks of the last message.
  std::size_t next_brick_ = 0;
};

/// Writes the store of all ranks at rank 0. @param pages  Pages of each rank. @return Number of pages.
std::size_t writeStore(const MpiRanks& ranks, const MapSnapshot& head, const VoxelStore& part,
                       std::vector<PagesOfRank> pages, const std::string& file) {
  std::vector<Cell> all;
  for (const auto& rank : pages) all.insert(all.end(), rank.pages().begin(), rank.pages().end());
  sortUnique(all);
  const auto bricks_of = [&](const Cell& page) {
    cuboid_mapping::throwIfInterrupted();
    std::vector<VoxelBrick> bricks = bricksIn(part, page);
    for (std::size_t rank = 1; rank < pages.size(); ++rank) pages[rank].take(ranks, page, bricks);
    cuboid_mapping::sortBricks(bricks);
    return bricks;
  };
  cuboid_mapping::replaceFile(file, [&](const std::string& partial) {
    cuboid_mapping::MapStore(partial, cuboid_mapping::StoreAccess::kWrite)
        .replaceAll(head, all, bricks_of);
    // Removes files left by a killed program that was replacing a store.
    std::filesystem::remove(file + "-wal");
  });
  return all.size();
}

/// Writes the store of all ranks. @return Its content, at rank 0.
std::string writePages(const MpiRanks& ranks, const MapSnapshot& head, const VoxelStore& part,
                       const std::string& file) {
  const std::vector<Cell> own = findPages(part);
  std::vector<std::string> to(static_cast<std::size_t>(ranks.size()));
  to.front() = toBytes(own);
  const std::vector<std::string> from = ranks.exchange(to);
  if (ranks.rank() != 0) {
    sendPages(ranks, head, part, own);
    return {};
  }
  std::vector<PagesOfRank> pages;
  pages.reserve(from.size());
  for (int rank = 0; rank < ranks.size(); ++rank) {
    pages.emplace_back(rank, pagesOfBytes(from[static_cast<std::size_t>(rank)]));
  }
  return cuboid_mapping::counted(writeStore(ranks, head, part, std::move(pages), file), "page");
}

/// Writes a file with tables over the whole map. @return Its content, at rank 0.
std::string writeWhole(const MpiRanks& ranks, MapSnapshot map, const std::string& file) {
  if (ranks.rank() != 0) {
    ranks.sendToFirst(toNativeFormat(map));
    return {};
  }
  for (int rank = 1; rank < ranks.size(); ++rank) {
    MapSnapshot other = cuboid_mapping::fromNativeFormat(ranks.receive(rank),
                                                         cuboid_mapping::SnapshotLimits::none());
    std::move(other.bricks.begin(), other.bricks.end(), std::back_inserter(map.bricks));
  }
  cuboid_mapping::sortBricks(map.bricks);
  cuboid_mapping::writeMapFile(file, map);
  return describeContent(map, *cuboid_mapping::formatOfName(file));
}

}  // namespace

MapSnapshot takePart(const MapSnapshot& head, const VoxelStore& part) {
  std::vector<VoxelBrick> bricks;
  part.forEach([&bricks](const VoxelBrick& brick) { bricks.push_back(brick); });
  cuboid_mapping::sortBricks(bricks);
  return withBricks(head, std::move(bricks));
}

std::string writeMapOfAll(const MpiRanks& ranks, const MapSnapshot& head, const VoxelStore& part,
                          const std::string& file) {
  return cuboid_mapping::formatOfName(file) == cuboid_mapping::MapFormat::kStore
             ? writePages(ranks, head, part, file)
             : writeWhole(ranks, takePart(head, part), file);
}

}  // namespace cuboid_mapping_ros
