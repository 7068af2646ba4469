// SPDX-License-Identifier: BSD-3-Clause
#include "brick_owner.h"

#include "cuboid_mapping/io/byte_stream.h"
#include "cuboid_mapping/io/scan_update_codec.h"

#include <chrono>
#include <ctime>
#include <limits>
#include <stdexcept>
#include <utility>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::BrickUpdate;
using cuboid_mapping::ByteReader;
using cuboid_mapping::ByteWriter;
using cuboid_mapping::Cell;
using cuboid_mapping::ScanUpdate;

constexpr std::size_t kAnyNumber = std::numeric_limits<std::uint32_t>::max();

/// Adds the CPU time from its beginning to its end.
class CpuStopwatch {
 public:
  explicit CpuStopwatch(double& sum_s) : sum_s_(sum_s), start_(std::clock()) {}
  ~CpuStopwatch() { sum_s_ += static_cast<double>(std::clock() - start_) / CLOCKS_PER_SEC; }
  CpuStopwatch(const CpuStopwatch&) = delete;
  CpuStopwatch& operator=(const CpuStopwatch&) = delete;

 private:
  double& sum_s_;
  std::clock_t start_;
};

}  // namespace

BrickOwner::BrickOwner(const MpiRanks& ranks, std::vector<cuboid_mapping::SensorModel> models,
                       int threads)
    : ranks_(ranks),
      models_(std::move(models)),
      threads_(threads),
      to_(static_cast<std::size_t>(ranks.size())) {}

std::size_t BrickOwner::ownerOf(const Cell& brick) const {
  // By the upper ones of its 32 bits: the lower ones know little of z.
  return cuboid_mapping::CellHash()(cuboid_mapping::groupOf(brick)) * to_.size() >> 32;
}

bool BrickOwner::add(const ScanUpdate* update, std::size_t source) {
  const CpuStopwatch stopwatch(cpu_times_.pack_s);
  std::vector<ScanUpdate> parts(to_.size());
  if (update != nullptr) {
    for (const BrickUpdate& brick : update->bricks) {
      parts[ownerOf(brick.brick)].bricks.push_back(brick);
    }
  }
  const auto own_rank = static_cast<std::size_t>(ranks_.rank());
  own_.push_back({std::move(parts[own_rank]), source});
  for (std::size_t owner = 0; owner < to_.size(); ++owner) {
    if (owner == own_rank) continue;
    const bool is_empty = parts[owner].bricks.empty();
    const std::string bytes = is_empty ? std::string() : toBytes(parts[owner]);
    ByteWriter part;
    part.writeU64(source);
    part.writeU64(bytes.size());
    part.writeBytes(bytes);
    to_[owner] += part.bytes();
  }
  return own_.size() == kCloudsOfRound;
}

std::vector<std::string> BrickOwner::sendAll() {
  const CpuStopwatch stopwatch(cpu_times_.exchange_s);
  const auto start = std::chrono::steady_clock::now();
  std::vector<std::string> from = ranks_.exchange(to_);
  const std::chrono::duration<double> time = std::chrono::steady_clock::now() - start;
  exchange_time_s_ += time.count();
  return from;
}

void BrickOwner::exchange() {
  const std::vector<std::string> from = sendAll();
  for (std::string& bytes : to_) {
    num_sent_bytes_ += bytes.size();
    bytes.clear();
  }
  std::vector<ByteReader> readers(from.begin(), from.end());
  for (std::size_t i = 0; i < kCloudsOfRound; ++i) {
    for (std::size_t rank = 0; rank < readers.size(); ++rank) {
      if (rank == static_cast<std::size_t>(ranks_.rank())) {
        if (i < own_.size()) apply(own_[i].update, own_[i].source);
        continue;
      }
      if (readers[rank].numLeft() == 0) continue;  // It had fewer clouds.
      const std::uint64_t source = readers[rank].readU64();
      const std::string_view bytes = readers[rank].readBytes(readers[rank].readU64());
      if (bytes.empty()) continue;
      const auto update = unpack(bytes);
      if (!update || source >= models_.size()) {
        throw std::runtime_error("what rank " + std::to_string(rank) + " has sent is damaged");
      }
      apply(*update, source);
    }
  }
  own_.clear();
}

std::optional<ScanUpdate> BrickOwner::unpack(std::string_view bytes) {
  const CpuStopwatch stopwatch(cpu_times_.pack_s);
  return cuboid_mapping::scanUpdateOfBytes(bytes, kAnyNumber);
}

void BrickOwner::restore(const std::vector<cuboid_mapping::VoxelBrick>& bricks) {
  voxels_.replace(cuboid_mapping::kAllCells, bricks);
}

void BrickOwner::apply(const ScanUpdate& update, std::size_t source) {
  const CpuStopwatch stopwatch(cpu_times_.apply_s);
  voxels_.apply(update.bricks, models_[source], threads_);
}

}  // namespace cuboid_mapping_ros
