// SPDX-License-Identifier: BSD-3-Clause
// Common parts of encoded maps and scans: zstd and checksums.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace cuboid_mapping {

/// CRC-32, as in zlib.
[[nodiscard]] std::uint32_t computeChecksum(std::string_view bytes);

/// One zstd frame. @param level  Compression level of zstd: 1 is fast.
[[nodiscard]] std::string compress(std::string_view payload, int level);

/// Inverse of compress(). Takes memory for the actual content, at most for the claimed size.
/// @throws MapFileError (kCorrupted) if the bytes are no frame of this size.
[[nodiscard]] std::string decompress(std::string_view compressed, std::uint64_t claimed_bytes);

}  // namespace cuboid_mapping
