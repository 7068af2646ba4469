// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/sharing/map_follower.h"

#include <cstdint>
#include <optional>
#include <vector>

namespace cuboid_mapping {

/// Bricks as they travel: brick_codec.h, deflated. msg/CuboidBricks.msg says what is in them. Part of the client and of
/// the Python module, not of cuboid_mapping::io: needs zlib alone.
struct PackedBricks {
  std::uint32_t num_bricks = 0;
  std::uint32_t num_values = 0;  ///< Different log-odds.
  bool has_values = false;
  std::vector<std::uint8_t> data;
};

/// @throws std::length_error when they are too many for a message; says what to do.
/// @complexity O(n) for n voxels, and the deflation.
[[nodiscard]] PackedBricks packBricks(const VoxelBrick* first, const VoxelBrick* last,
                                      MapDetail detail);

/// Inverse of packBricks(). @return Nothing when the message is damaged.
[[nodiscard]] std::optional<std::vector<VoxelBrick>> unpackBricks(const PackedBricks& packed);

/// Divides bricks among messages, in their order.
/// @param max_bytes  Of a part, before it is deflated; a part has a brick at least. @return The end of the first part.
[[nodiscard]] const VoxelBrick* endOfPart(const VoxelBrick* first, const VoxelBrick* last,
                                          MapDetail detail, std::size_t max_bytes);

}  // namespace cuboid_mapping
