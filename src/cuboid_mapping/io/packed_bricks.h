// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/sharing/map_follower.h"

#include <cstdint>
#include <optional>
#include <vector>

namespace cuboid_mapping {

/// Bricks of a message: brick_codec.h, deflated. msg/CuboidBricks.msg documents the fields. Part of the client
/// and of the Python module, not of cuboid_mapping::io: needs zlib alone.
struct PackedBricks {
  std::uint32_t num_bricks = 0;
  std::uint32_t num_values = 0;  ///< Number of different log-odds.
  bool has_values = false;
  std::vector<std::uint8_t> data;
};

/// @throws std::length_error if there are too many for a message; says what to do.
/// @complexity O(n) for n voxels, plus the deflation.
[[nodiscard]] PackedBricks packBricks(const VoxelBrick* first, const VoxelBrick* last,
                                      MapDetail detail);

/// Inverse of packBricks(). @return Nothing when the message is damaged.
[[nodiscard]] std::optional<std::vector<VoxelBrick>> unpackBricks(const PackedBricks& packed);

/// Divides bricks among messages, in order.
/// @param max_bytes  Limit of a part before deflation; a part has at least one brick. @return End of the first
///                   part.
[[nodiscard]] const VoxelBrick* endOfPart(const VoxelBrick* first, const VoxelBrick* last,
                                          MapDetail detail, std::size_t max_bytes);

}  // namespace cuboid_mapping
