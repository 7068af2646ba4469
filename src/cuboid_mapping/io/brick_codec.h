// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/sharing/map_image.h"

#include <cstdint>
#include <vector>

namespace cuboid_mapping {

/// Bricks as they travel: about a third of their size. msg/CuboidBricks.msg says what is in them. Part of the
/// client and of the Python module, not of cuboid_mapping::io: needs zlib alone.
struct PackedBricks {
  std::uint32_t num_bricks = 0;
  std::uint32_t num_cuboids = 0;
  bool has_values = false;
  std::vector<float> values;       ///< Log-odds that occur, each once.
  std::vector<std::uint8_t> data;  ///< The arrays, one after the other, deflated.
};

/// Divides bricks among messages, in their order.
class BrickSplitter {
 public:
  /// @param all  Fit together; must outlive this object.
  /// @param max_bytes  Of a part, before it is deflated; a part has a brick at least.
  BrickSplitter(const BrickArrays& all, std::size_t max_bytes) : all_(all), max_bytes_(max_bytes) {}

  [[nodiscard]] bool isDone() const { return brick_ == all_.counts.size(); }
  /// The next part; nothing after the last. @complexity O(n) for what is in it.
  BrickArrays next();

 private:
  const BrickArrays& all_;
  std::size_t max_bytes_;
  std::size_t brick_ = 0;
  std::size_t cuboid_ = 0;
  std::size_t value_ = 0;
};

/// Puts bricks behind others that have values, too, or have none, either.
void appendBricks(const BrickArrays& from, BrickArrays& to);

/// @throws std::length_error when they are too many for a message; says what to do.
/// @complexity O(n) for n cuboids, with values voxels, and the deflation.
[[nodiscard]] PackedBricks packBricks(const BrickArrays& arrays);

/// Inverse of packBricks(). @return false when the message is damaged.
[[nodiscard]] bool unpackBricks(const PackedBricks& packed, BrickArrays& arrays);

}  // namespace cuboid_mapping
