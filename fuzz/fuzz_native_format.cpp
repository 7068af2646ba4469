// SPDX-License-Identifier: BSD-3-Clause
// Damaged files of both versions of the native format. A second kind of input gets valid checksums, so that the
// code after their check is reached, too.
#include "cuboid_mapping/io/native_format.h"

#include "fuzz_limits.h"
#include "fuzz_target.h"

#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <string>

namespace {

using cuboid_mapping::fromNativeFormat;
using cuboid_mapping::MapFileError;

constexpr std::size_t kPayloadBytesAt = 72;
constexpr std::size_t kCompressedBytesAt = 80;
constexpr std::size_t kFrameIdBytesAt = 88;
constexpr std::size_t kHeaderBytes = 92;

template <typename T>
void overwrite(std::string& bytes, std::size_t place, T value) {
  std::memcpy(bytes.data() + place, &value, sizeof(value));
}

std::uint32_t computeChecksum(const std::string& bytes) {
  return static_cast<std::uint32_t>(
      crc32(0, reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uInt>(bytes.size())));
}

void append(std::string& bytes, std::uint32_t value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof(value));
}

/// A file whose header is the first bytes of the input, and whose content before compression is the
/// rest.
std::string sealFile(const std::string& input) {
  std::string file = input.substr(0, kHeaderBytes);
  const std::string payload = input.substr(kHeaderBytes);
  std::string compressed(ZSTD_compressBound(payload.size()), '\0');
  compressed.resize(
      ZSTD_compress(compressed.data(), compressed.size(), payload.data(), payload.size(), 1));
  overwrite<std::uint64_t>(file, kPayloadBytesAt, payload.size());
  overwrite<std::uint64_t>(file, kCompressedBytesAt, compressed.size());
  overwrite<std::uint32_t>(file, kFrameIdBytesAt, 0);
  append(file, computeChecksum(file));
  file += compressed;
  append(file, computeChecksum(compressed));
  return file;
}

bool isSame(const cuboid_mapping::VoxelBrick& a, const cuboid_mapping::VoxelBrick& b) {
  return a.brick == b.brick && a.voxels == b.voxels;
}

/// Reads a file; an accepted map must be valid, and come back from its own file.
void read(const std::string& bytes) {
  const cuboid_mapping::SnapshotLimits limits = cuboid_mapping::fuzzLimits();
  try {
    const auto snapshot = fromNativeFormat(bytes, limits);
    const auto again = fromNativeFormat(toNativeFormat(snapshot), limits);
    if (!std::equal(again.bricks.begin(), again.bricks.end(), snapshot.bricks.begin(),
                    snapshot.bricks.end(), isSame)) {
      std::abort();
    }
  } catch (const MapFileError&) {
    // Refused, as expected.
  }
}

}  // namespace

FUZZ_TARGET(fuzz_native_format) {
  const std::string input(reinterpret_cast<const char*>(data), size);
  read(input);
  if (size >= kHeaderBytes) read(sealFile(input));
  return 0;
}
