// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "bag_clouds.h"
#include "mpi/brick_owner.h"
#include "mpi/mpi_ranks.h"

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {

/// Progress of all ranks together.
struct MpiProgress {
  std::uint64_t num_rounds = 0;
  std::vector<std::uint64_t> sums;  ///< Figures that add up over ranks and runs.
  LeftOutClouds left_out;
  std::string failures;  ///< See BagFiles::failures(); at rank 0.
};

/// The state of a run, in a folder beside its output, from which a later run continues: an index, and a map of
/// each rank. The state is complete at any moment: the index names the maps, and is replaced when all of them
/// are written.
///
/// Every function waits until all ranks have called it.
class MpiCheckpoint {
 public:
  /// @param ranks  Must outlive this object. @param run  Bags and settings, which decide the result.
  /// @param period_s  Time between two checkpoints; 0: none is made or read.
  MpiCheckpoint(const MpiRanks& ranks, const std::string& output, std::string run, double period_s);

  /// Reason why a checkpoint cannot be continued: other bags, settings or ranks. Empty: there is none, or it
  /// can. For rank 0 alone; it does not wait.
  [[nodiscard]] std::string findFault() const;

  /// Gives the owner its bricks. @return Progress of the earlier run; zero if there is none.
  /// @throws cuboid_mapping::MapFileError  A file is damaged or missing.
  /// @throws std::runtime_error  The ranks do not share the folder.
  [[nodiscard]] MpiProgress resume(BrickOwner& owner) const;

  /// Whether it is time to write.
  [[nodiscard]] bool isDue() const;
  /// @param progress  Progress of all runs so far. @throws cuboid_mapping::MapFileError  A file cannot be
  ///                  written.
  void write(const MpiProgress& progress, const cuboid_mapping::MapSnapshot& part);
  /// Removes the checkpoint when the output is written. For rank 0 alone; it does not wait.
  void remove() const;

 private:
  [[nodiscard]] std::string partName(std::uint64_t num_rounds) const;

  const MpiRanks& ranks_;
  std::string folder_;
  std::string run_;
  double period_s_;
  std::chrono::steady_clock::time_point last_;
};

}  // namespace cuboid_mapping_ros
