// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/io/packed_bricks.h"

#include "cuboid_mapping/io/brick_codec.h"

#include <zlib.h>

#include <new>
#include <stdexcept>
#include <string>

namespace cuboid_mapping {
namespace {

/// Limit of a message; one that claims more is damaged.
constexpr std::size_t kMaxBytes = std::size_t{1} << 30;

std::vector<std::uint8_t> deflateBytes(const std::string& bytes) {
  uLongf size = compressBound(bytes.size());
  std::vector<std::uint8_t> packed(size);
  const int state = compress2(packed.data(), &size, reinterpret_cast<const Bytef*>(bytes.data()),
                              bytes.size(), Z_BEST_SPEED);
  if (state != Z_OK) throw std::bad_alloc();  // It fails for lack of memory only.
  packed.resize(size);
  return packed;
}

/// Inflates bytes; empty if they are damaged. Takes memory for the actual content, not for a claimed size.
std::string inflateBytes(const std::vector<std::uint8_t>& packed) {
  z_stream stream{};
  if (inflateInit(&stream) != Z_OK) throw std::bad_alloc();
  stream.next_in = const_cast<Bytef*>(packed.data());
  stream.avail_in = static_cast<uInt>(packed.size());
  std::string bytes;
  int state = Z_OK;
  while (state == Z_OK && bytes.size() <= kMaxBytes) {
    constexpr std::size_t kStep_bytes = std::size_t{1} << 18;
    const std::size_t begin = bytes.size();
    bytes.resize(begin + kStep_bytes);
    stream.next_out = reinterpret_cast<Bytef*>(&bytes[begin]);
    stream.avail_out = kStep_bytes;
    state = inflate(&stream, Z_NO_FLUSH);
    bytes.resize(begin + kStep_bytes - stream.avail_out);
  }
  const bool is_whole = state == Z_STREAM_END && stream.avail_in == 0;
  inflateEnd(&stream);
  return is_whole ? bytes : std::string();
}

/// Maximum size before deflation, with up to 16384 different values and at most 512 bricks from the previous
/// one.
std::size_t bytesOf(const VoxelBrick& brick, MapDetail detail) {
  const std::size_t content = detail == MapDetail::kClasses
                                  ? sizeof(BrickMask)
                                  : 2 * static_cast<std::size_t>(brick.voxels.known().count());
  return 6 + sizeof(BrickMask) + content;
}

}  // namespace

PackedBricks packBricks(const VoxelBrick* first, const VoxelBrick* last, MapDetail detail) {
  PackedBricks packed;
  packed.has_values = detail == MapDetail::kValues;
  packed.num_bricks = static_cast<std::uint32_t>(last - first);
  ByteWriter bytes;
  packed.num_values =
      static_cast<std::uint32_t>(encodeBricks(first, last, packed.has_values, bytes));
  // roscpp silently drops a message of 1 GB, and subscribers take it for damaged.
  if (bytes.bytes().size() > kMaxBytes) {
    throw std::length_error(
        "too much for a message: " + std::to_string(bytes.bytes().size() / 1000000) +
        " MB, but at most " + std::to_string(kMaxBytes / 1000000) +
        " are allowed. Send classes only (publish_values: false)");
  }
  packed.data = deflateBytes(bytes.bytes());
  return packed;
}

std::optional<std::vector<VoxelBrick>> unpackBricks(const PackedBricks& packed) {
  const std::string bytes = inflateBytes(packed.data);
  // A brick without a known voxel has no log-odds.
  const std::size_t least_bytes =
      (kLeastBrickBytes - 1) * packed.num_bricks + sizeof(float) * packed.num_values;
  if (bytes.size() < least_bytes || (!packed.has_values && packed.num_values > 0)) {
    return std::nullopt;
  }
  try {
    ByteReader reader(bytes);
    auto bricks = decodeBricks(packed.num_bricks, packed.num_values, packed.has_values, reader);
    if (reader.numLeft() != 0) return std::nullopt;
    return bricks;
  } catch (const MapFileError&) {
    return std::nullopt;
  }
}

const VoxelBrick* endOfPart(const VoxelBrick* first, const VoxelBrick* last, MapDetail detail,
                            std::size_t max_bytes) {
  std::size_t num_bytes = 0;
  const VoxelBrick* end = first;
  for (; end != last; ++end) {
    num_bytes += bytesOf(*end, detail);
    if (num_bytes > max_bytes && end != first) break;
  }
  return end;
}

}  // namespace cuboid_mapping
