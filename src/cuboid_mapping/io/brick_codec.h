// SPDX-License-Identifier: BSD-3-Clause
// Bricks as bytes, column by column: the content of native files, of pages of a store, and of messages of maps,
// see doc/file_format.md. Compression and counts are left to the callers. Part of cuboid_mapping::core.
#pragma once

#include "cuboid_mapping/io/byte_stream.h"
#include "cuboid_mapping/map/progress_listener.h"
#include "cuboid_mapping/voxels/voxel_store.h"

#include <cstddef>
#include <vector>

namespace cuboid_mapping {

/// Minimum number of bytes of a brick: its place, its known voxels, and the index of one log-odds or the occupied voxels.
constexpr std::size_t kLeastBrickBytes = 3 + sizeof(BrickMask) + 1;

/// Appends bricks. @param has_values  false: only their classes. @param listener  Reports bricks.
/// @return Number of different log-odds; 0 without values. @complexity O(n) for n voxels.
std::size_t encodeBricks(const VoxelBrick* first, const VoxelBrick* last, bool has_values,
                         ByteWriter& bytes, const ProgressListener& listener = {});

/// Inverse of encodeBricks(). Without values, voxels have the log-odds of the clamping thresholds of a default
/// sensor model.
/// @pre The bytes are enough for these numbers of bricks and log-odds.
/// @throws MapFileError: kTruncated; kCorrupted for a brick outside kAllCells, or log-odds that are not finite.
[[nodiscard]] std::vector<VoxelBrick> decodeBricks(std::size_t num_bricks, std::size_t num_log_odds,
                                                   bool has_values, ByteReader& bytes);

/// Parts of other columns of native files and observations.
///@{
void writeMask(const BrickMask& mask, ByteWriter& bytes);
[[nodiscard]] BrickMask readMask(ByteReader& bytes);
/// The log-odds that occur. @throws MapFileError  as decodeBricks().
[[nodiscard]] std::vector<float> decodeLogOdds(std::size_t count, ByteReader& bytes);
/// The log-odds that an index names. @throws MapFileError  as decodeBricks().
[[nodiscard]] float readLogOdds(const std::vector<float>& log_odds, ByteReader& bytes);

/// A coordinate of a brick. In 64 bits, since damaged numbers may be of any size.
/// @throws MapFileError (kCorrupted) if no brick of a map can have it.
[[nodiscard]] std::int32_t toBrickPlace(std::int64_t place);

/// Writes the differences of successive numbers.
class DifferenceWriter {
 public:
  explicit DifferenceWriter(ByteWriter& bytes) : bytes_(bytes) {}
  void write(std::int32_t number) {
    bytes_.writeVarint(toZigzag(number - previous_));
    previous_ = number;
  }

 private:
  ByteWriter& bytes_;
  std::int32_t previous_ = 0;
};

/// Inverse of DifferenceWriter, for coordinates of cells.
class DifferenceReader {
 public:
  explicit DifferenceReader(ByteReader& bytes) : bytes_(bytes) {}
  /// @throws MapFileError (kCorrupted) outside kAllCells.
  std::int32_t read();
  /// As above, for the number of a brick along an axis: its coordinate.
  std::int32_t readBrickPlace() { return toBrickPlace(std::int64_t{read()} * kBrickEdge); }

 private:
  ByteReader& bytes_;
  std::int64_t number_ = 0;
};
///@}

}  // namespace cuboid_mapping
