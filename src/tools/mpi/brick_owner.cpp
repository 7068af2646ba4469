// SPDX-License-Identifier: BSD-3-Clause
#include "mpi/brick_owner.h"

#include "cuboid_mapping/voxels/brick_store.h"

#include <chrono>
#include <ctime>
#include <optional>
#include <stdexcept>
#include <utility>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::BrickUpdate;
using cuboid_mapping::Cell;
using cuboid_mapping::ScanUpdate;

double cpuTime_s() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

double wallTime_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Adds the time of a clock during its life.
class Lap {
 public:
  Lap(double (*now_s)(), double& sum_s) : now_s_(now_s), sum_s_(sum_s), start_s_(now_s()) {}
  ~Lap() { sum_s_ += now_s_() - start_s_; }
  Lap(const Lap&) = delete;
  Lap& operator=(const Lap&) = delete;

 private:
  double (*now_s_)();
  double& sum_s_;
  double start_s_;
};

}  // namespace

BrickOwner::BrickOwner(const MpiRanks& ranks, std::vector<cuboid_mapping::SensorModel> models,
                       int threads)
    : ranks_(ranks), models_(std::move(models)), threads_(threads) {
  const auto size = static_cast<std::size_t>(ranks.size());
  round_.to.resize(size);
  last_.to.resize(size);
  received_.resize(size);
}

std::size_t BrickOwner::ownerOf(const Cell& group) const {
  // Uses the upper ones of the 32 bits: the lower ones depend little on z.
  return cuboid_mapping::CellHash()(group) * round_.to.size() >> 32;
}

bool BrickOwner::add(const ScanUpdate* update, std::size_t source) {
  const Lap cpu(cpuTime_s, cpu_times_.pack_s);
  for (PartWriter& to : round_.to) to.beginCloud(source);
  if (update != nullptr) {
    std::optional<Cell> group;  // Consecutive bricks mostly share a group.
    std::size_t owner = 0;
    for (const BrickUpdate& brick : update->bricks) {
      if (group != cuboid_mapping::groupOf(brick.brick)) {
        group = cuboid_mapping::groupOf(brick.brick);
        owner = ownerOf(*group);
      }
      round_.to[owner].add(brick);
    }
  }
  return ++round_.num_clouds == kCloudsOfRound;
}

void BrickOwner::endRound() {
  startSending(round_);
  takeAll(last_);
  std::swap(round_, last_);
}

void BrickOwner::finish() { takeAll(last_); }

void BrickOwner::startSending(Round& round) {
  const Lap cpu(cpuTime_s, cpu_times_.exchange_s);
  const Lap wall(wallTime_s, exchange_time_s_);
  std::vector<std::string_view> to;
  for (const PartWriter& part : round.to) to.push_back(part.bytes());
  for (std::size_t rank = 0; rank < to.size(); ++rank) {
    if (rank != static_cast<std::size_t>(ranks_.rank())) num_sent_bytes_ += to[rank].size();
  }
  round.sends = ranks_.startSending(to);
  round.is_sent = true;
}

void BrickOwner::takeAll(Round& round) {
  if (!round.is_sent) return;
  std::vector<PartReader> from;
  {
    const Lap cpu(cpuTime_s, cpu_times_.exchange_s);
    const Lap wall(wallTime_s, exchange_time_s_);
    for (int rank = 0; rank < ranks_.size(); ++rank) {
      const auto number = static_cast<std::size_t>(rank);
      if (rank == ranks_.rank()) {
        from.emplace_back(round.to[number].bytes());
      } else {
        ranks_.receiveNext(rank, received_[number]);
        from.emplace_back(received_[number]);
      }
    }
    round.sends.wait();
  }
  applyAll(from);
  for (PartWriter& to : round.to) to.clear();
  round.num_clouds = 0;
  round.is_sent = false;
}

void BrickOwner::applyAll(std::vector<PartReader>& from) {
  for (std::size_t i = 0; i < kCloudsOfRound; ++i) {
    for (std::size_t rank = 0; rank < from.size(); ++rank) {
      try {
        applyNext(from[rank]);
      } catch (const std::runtime_error& error) {
        throw std::runtime_error("the message of rank " + std::to_string(rank) +
                                 " is damaged: " + error.what());
      }
    }
  }
}

void BrickOwner::applyNext(PartReader& from) {
  if (from.isAtEnd()) return;  // It had fewer clouds.
  std::size_t source = 0;
  {
    const Lap cpu(cpuTime_s, cpu_times_.pack_s);
    source = from.read(part_);
    if (source >= models_.size()) throw std::runtime_error("it names no source");
  }
  const Lap cpu(cpuTime_s, cpu_times_.apply_s);
  voxels_.apply(part_, models_[source], {threads_, false});
}

void BrickOwner::restore(const std::vector<cuboid_mapping::VoxelBrick>& bricks) {
  auto change = voxels_.prepareReplace(cuboid_mapping::kAllCells, bricks, {threads_, false});
  voxels_.reserve(change);
  voxels_.commit(change, [](const auto& /*brick*/) {});
}

}  // namespace cuboid_mapping_ros
