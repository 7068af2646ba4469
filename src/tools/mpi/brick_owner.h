// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"
#include "mpi/cloud_parts.h"
#include "mpi/mpi_ranks.h"

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {

/// CPU seconds of a process, all threads, spent on its clouds.
struct CpuTimes {
  double pack_s = 0.0;      ///< Time to divide and pack updates for others, and to unpack theirs.
  double exchange_s = 0.0;  ///< Time to send, and to wait if that takes CPU time.
  double apply_s = 0.0;     ///< Time to put updates into the map.
};

/// One rank's part of a map that is divided among ranks, and its messages to the others.
///
/// Each group of 4 x 4 x 4 bricks has an owner, by a hash of its place, so that each cloud is divided about
/// equally among all owners, wherever the sensor drives. Ranks walk clouds in rounds: rank r walks clouds r, r
/// + size, ... of a round. At the end of a round the updates of the clouds are sent to the owners. Each owner
/// receives them at the end of the next round, so that no rank waits for one that is a little slower, and
/// applies them in the order of the clouds. The voxels are those of one map with all clouds.
class BrickOwner {
 public:
  /// Number of clouds of a rank in a round. A large number evens out slow clouds.
  static constexpr std::size_t kCloudsOfRound = 4;

  /// @param ranks  Must outlive this object. @param models  Sensor model of each source. @param threads  See
  ///               VoxelStore::Work.
  BrickOwner(const MpiRanks& ranks, std::vector<cuboid_mapping::SensorModel> models, int threads);

  /// Adds the update of the rank's next cloud. @param update  Null: the cloud changes nothing.
  /// @return Whether the round has all clouds of this rank: endRound() is next.
  bool add(const cuboid_mapping::ScanUpdate* update, std::size_t source);
  /// Ends the round, and applies the previous one; all ranks call it equally often.
  /// @throws std::runtime_error if received data are damaged.
  void endRound();
  /// Applies the last round, too; all ranks call it after the same round. Throws as endRound().
  void finish();

  /// Starts from these bricks of the rank, from voxels() of an earlier run with as many ranks.
  void restore(const std::vector<cuboid_mapping::VoxelBrick>& bricks);

  /// The rank's bricks. @pre finish() was called.
  [[nodiscard]] const cuboid_mapping::VoxelStore& voxels() const { return voxels_; }
  [[nodiscard]] std::uint64_t numSentBytes() const { return num_sent_bytes_; }
  /// Time at ends of rounds for waiting for slower ranks, and sending.
  [[nodiscard]] double exchangeTime_s() const { return exchange_time_s_; }
  /// CPU times of this process, so far.
  [[nodiscard]] const CpuTimes& cpuTimes() const { return cpu_times_; }

 private:
  /// The observations of the rank's clouds of a round.
  struct Round {
    std::vector<PartWriter> to;  ///< Parts by owner, own part included.
    std::size_t num_clouds = 0;
    bool is_sent = false;
    MpiSends sends;
  };

  [[nodiscard]] std::size_t ownerOf(const cuboid_mapping::Cell& group) const;
  void startSending(Round& round);
  /// Applies the received updates, and clears the round. Does nothing if none was sent.
  void takeAll(Round& round);
  void applyAll(std::vector<PartReader>& from);
  /// Applies the next part of a rank, if it has one.
  void applyNext(PartReader& from);

  const MpiRanks& ranks_;
  std::vector<cuboid_mapping::SensorModel> models_;
  int threads_;
  cuboid_mapping::VoxelStore voxels_;
  Round round_;                                    ///< Current round.
  Round last_;                                     ///< Round that is sent, but not yet applied.
  std::vector<std::string> received_;              ///< Received bytes by rank.
  std::vector<cuboid_mapping::BrickUpdate> part_;  ///< Part that is being applied.
  std::uint64_t num_sent_bytes_ = 0;
  double exchange_time_s_ = 0.0;
  CpuTimes cpu_times_;
};

}  // namespace cuboid_mapping_ros
