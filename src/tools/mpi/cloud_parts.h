// SPDX-License-Identifier: BSD-3-Clause
// Observations of one rank's bricks, as bytes for that rank. Many times as fast as toBytes() of
// io/scan_update_codec.h, with twice as many bytes: between ranks, time matters more.
#pragma once

#include "cuboid_mapping/scan/brick_update.h"

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace cuboid_mapping_ros {

/// Writes parts of clouds, one after the other. The memory is reused.
///
/// A part is its source and the number of its bricks, 4 bytes each; then for each brick a byte, 1 if it is
/// grazed; its difference to the previous brick, three varints; and for hits, misses and, if there are any,
/// grazes: two bits for each slice, for empty (0), full (1) or stored (2), and the stored slices.
class PartWriter {
 public:
  /// Begins the part of the next cloud.
  void beginCloud(std::size_t source);
  /// Adds a brick to it. A voxel that is both hit and missed is a hit afterwards, which is the same to a map.
  void add(const cuboid_mapping::BrickUpdate& brick);

  /// All parts since the last clear(). Valid until the next call.
  [[nodiscard]] std::string_view bytes() const { return {bytes_.data(), end_}; }
  void clear() { end_ = 0; }

 private:
  void reserve(std::size_t num_bytes);
  void writeVarint(std::uint32_t value);
  void writeMask(const cuboid_mapping::BrickMask& mask);

  std::string bytes_;
  std::size_t end_ = 0;    ///< End of the written bytes.
  std::size_t begin_ = 0;  ///< Start of the part.
  cuboid_mapping::Cell last_;
  std::uint32_t num_bricks_ = 0;  ///< Bricks of the part.
};

/// Reads the output of a PartWriter.
class PartReader {
 public:
  PartReader() = default;
  explicit PartReader(std::string_view bytes) : bytes_(bytes) {}

  [[nodiscard]] bool isAtEnd() const { return bytes_.empty(); }
  /// Takes the next part. @param bricks  Its bricks. @return Its source.
  /// @throws std::runtime_error  when the bytes end too early.
  std::size_t read(std::vector<cuboid_mapping::BrickUpdate>& bricks);

 private:
  const char* take(std::size_t num_bytes);
  std::uint32_t readU32();
  std::uint32_t readVarint();
  void readMask(cuboid_mapping::BrickMask& mask);

  std::string_view bytes_;
};

}  // namespace cuboid_mapping_ros
