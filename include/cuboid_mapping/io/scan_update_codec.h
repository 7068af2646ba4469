// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/scan/brick_update.h"

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace cuboid_mapping {

/// The observations of a cloud as bytes, for another process: 2 to 8 % of the cloud's size.
/// doc/file_format.md has the format.
/// @complexity O(n) for n bricks and samples.
[[nodiscard]] std::string toBytes(const ScanUpdate& update);

/// Inverse of toBytes(). A voxel that was hit and missed is read as a hit alone, which has the same effect on a
/// map.
///
/// @return  Nothing if the bytes are damaged: too few or too many, a wrong checksum, an empty brick, a brick or
///          sample outside kAllCells, or more bricks and samples than `max_items`. Takes memory for the actual
///          items, about 400 bytes each, not for a claimed number.
[[nodiscard]] std::optional<ScanUpdate> scanUpdateOfBytes(std::string_view bytes,
                                                          std::size_t max_items = std::size_t{1}
                                                                                  << 21);

}  // namespace cuboid_mapping
