// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/map_snapshot.h"

#include <stdexcept>
#include <string>
#include <vector>

namespace cuboid_mapping {

/// Reason why a map cannot be read or written.
enum class MapFileDefect : unsigned char {
  kInaccessible,  ///< Missing, not readable, not writable, a folder, or a full disk.
  kForeign,       ///< The file has another format.
  kNewerVersion,  ///< The file has a later version of the format.
  kTruncated,     ///< The file ends too early.
  kCorrupted,     ///< A checksum or a value is wrong, or something follows the end.
  kTooBig,        ///< The map exceeds the limits of the caller, or of a format.
};

/// Thrown by all functions that read and write maps; what() has the defect and the cure.
class MapFileError : public std::runtime_error {
 public:
  /// @param text  For what(): the defect and the cure.
  MapFileError(MapFileDefect defect, const std::string& text)
      : std::runtime_error(text), defect_(defect) {}

  /// Kind of the defect.
  [[nodiscard]] MapFileDefect defect() const { return defect_; }

 private:
  MapFileDefect defect_;
};

/// Checks a snapshot that was read. @throws MapFileError (kTooBig or kCorrupted) when findFault() finds
/// something.
void throwIfFaulty(const MapSnapshot& snapshot, const SnapshotLimits& limits);

/// The bricks of boxes that were read from a file.
/// @throws MapFileError: kCorrupted for a box that is empty, reaches outside kAllCells, shares a cell
///         with another, or has a log-odds that is not finite; kTooBig for too many bricks.
[[nodiscard]] std::vector<VoxelBrick> bricksOf(const std::vector<UniformBox>& boxes,
                                               const SnapshotLimits& limits);

}  // namespace cuboid_mapping
