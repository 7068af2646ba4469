// SPDX-License-Identifier: BSD-3-Clause
// The file format of this package, described byte by byte in doc/file_format.md.
#pragma once

#include "cuboid_mapping/io/map_file_error.h"
#include "cuboid_mapping/map/map_snapshot.h"
#include "cuboid_mapping/map/progress_listener.h"

#include <cstdint>
#include <string>
#include <string_view>

namespace cuboid_mapping {

/// Newest version of the format, for maps with fused cuboids of FusionKind::kGrowth; others have version 3 with locks,
/// else 2. All older versions can be read.
constexpr std::uint32_t kNativeFormatVersion = 4;

/// A snapshot as the bytes of a file. Equal maps give equal bytes.
/// @pre findFault() finds none. A frame_id is cut after 255 bytes. @param listener  Reports bricks. @complexity
/// O(n).
[[nodiscard]] std::string toNativeFormat(const MapSnapshot& snapshot,
                                         const ProgressListener& listener = {});

/// Inverse of toNativeFormat(); reads older versions, too.
///
/// @throws MapFileError: kForeign for another magic number, kNewerVersion, kTruncated, kCorrupted
///         for a wrong checksum, an invalid value, or cuboids that overlap, kTooBig where
///         more is claimed than the limits allow. Memory stays within the bound of
///         SnapshotLimits::ofMemory().
[[nodiscard]] MapSnapshot fromNativeFormat(std::string_view bytes,
                                           const SnapshotLimits& limits = {});

}  // namespace cuboid_mapping
