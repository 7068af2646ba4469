// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/io/native_format.h"

#include "byte_stream.h"

#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <array>
#include <memory>

namespace cuboid_mapping {
namespace {

constexpr std::string_view kMagic(
    "\x89"
    "CUB\r\n\x1a\n",
    8);
constexpr std::size_t kMaxFrameIdBytes = 255;
constexpr int kCompressionLevel = 3;
/// Bytes of a cuboid before compression, at least: one for each column.
constexpr std::uint64_t kColumns = 7;

[[noreturn]] void fail(MapFileDefect defect, const std::string& text) {
  throw MapFileError(defect, text);
}

[[noreturn]] void failCorrupted(const std::string& what) {
  fail(MapFileDefect::kCorrupted,
       "is damaged: " + what + ". Take another copy of the file, or save the map again");
}

std::uint32_t computeChecksum(std::string_view bytes) {
  uLong checksum = crc32(0L, Z_NULL, 0);
  constexpr std::size_t kStep_bytes = std::size_t{1} << 30;
  for (std::size_t i = 0; i < bytes.size(); i += kStep_bytes) {
    const std::string_view part = bytes.substr(i, kStep_bytes);
    checksum = crc32(checksum, reinterpret_cast<const Bytef*>(part.data()),
                     static_cast<uInt>(part.size()));
  }
  return static_cast<std::uint32_t>(checksum);
}

std::uint32_t toZigzag(std::int32_t value) {
  return static_cast<std::uint32_t>(value) << 1 ^ static_cast<std::uint32_t>(value >> 31);
}

std::int32_t fromZigzag(std::uint32_t value) {
  return static_cast<std::int32_t>(value >> 1 ^ (0U - (value & 1U)));
}

std::vector<float> collectLogOdds(const std::vector<Cuboid>& cuboids) {
  std::vector<float> values;
  values.reserve(cuboids.size());
  for (const Cuboid& cuboid : cuboids) values.push_back(cuboid.log_odds);
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
  return values;
}

std::string encodePayload(const std::vector<Cuboid>& cuboids, const std::vector<float>& log_odds) {
  ByteWriter payload;
  for (const float value : log_odds) payload.writeF32(value);
  for (int axis = 0; axis < 3; ++axis) {
    std::int32_t previous = 0;
    for (const Cuboid& cuboid : cuboids) {
      payload.writeVarint(toZigzag(cuboid.box.min[axis] - previous));
      previous = cuboid.box.min[axis];
    }
  }
  for (int axis = 0; axis < 3; ++axis) {
    for (const Cuboid& cuboid : cuboids) {
      // Unsigned: all the cells of an axis are one more than an int32 can count.
      payload.writeVarint(static_cast<std::uint32_t>(cuboid.box.max[axis]) -
                          static_cast<std::uint32_t>(cuboid.box.min[axis]) - 1U);
    }
  }
  for (const Cuboid& cuboid : cuboids) {
    const auto place = std::lower_bound(log_odds.begin(), log_odds.end(), cuboid.log_odds);
    payload.writeVarint(static_cast<std::uint32_t>(place - log_odds.begin()));
  }
  return payload.take();
}

std::string compress(const std::string& payload) {
  std::string compressed(ZSTD_compressBound(payload.size()), '\0');
  const std::size_t size = ZSTD_compress(compressed.data(), compressed.size(), payload.data(),
                                         payload.size(), kCompressionLevel);
  if (ZSTD_isError(size) != 0) throw std::bad_alloc();  // it fails for lack of memory only
  compressed.resize(size);
  return compressed;
}

/// Grows with what is really there, so that a claim alone takes no memory.
std::string decompress(std::string_view compressed, std::uint64_t claimed_bytes) {
  const std::unique_ptr<ZSTD_DCtx, std::size_t (*)(ZSTD_DCtx*)> context(ZSTD_createDCtx(),
                                                                        ZSTD_freeDCtx);
  if (context == nullptr) throw std::bad_alloc();
  std::string payload;
  std::string chunk(ZSTD_DStreamOutSize(), '\0');
  ZSTD_inBuffer in{compressed.data(), compressed.size(), 0};
  std::size_t is_open = 1;  // 0 at the end of the frame
  while (is_open != 0) {
    ZSTD_outBuffer out{chunk.data(), chunk.size(), 0};
    const std::size_t position = in.pos;
    is_open = ZSTD_decompressStream(context.get(), &out, &in);
    if (ZSTD_isError(is_open) != 0) failCorrupted("its content cannot be decompressed");
    payload.append(chunk, 0, out.pos);
    if (payload.size() > claimed_bytes) failCorrupted("it holds more than it says");
    if (is_open != 0 && out.pos == 0 && in.pos == position) {
      failCorrupted("its compressed content has no end");
    }
  }
  if (in.pos != in.size || payload.size() != claimed_bytes) {
    failCorrupted("its content has not the length that it says");
  }
  return payload;
}

/// The numbers of a header that a snapshot does not have.
struct Sizes {
  std::uint64_t num_cuboids;
  std::uint64_t num_log_odds;
  std::uint64_t payload_bytes;
  std::uint64_t compressed_bytes;
};

std::string encodeHeader(const MapSnapshot& snapshot, const Sizes& sizes) {
  ByteWriter header;
  header.writeBytes(kMagic);
  header.writeU32(kNativeFormatVersion);
  header.writeU32(snapshot.environment == Environment::kStatic ? 1 : 0);
  const SensorModelConfig& model = snapshot.sensor_model;
  for (const double value :
       {snapshot.resolution_m, model.hit, model.miss, model.alpha_min, model.alpha_max}) {
    header.writeF64(value);
  }
  for (const std::uint64_t size :
       {sizes.num_cuboids, sizes.num_log_odds, sizes.payload_bytes, sizes.compressed_bytes}) {
    header.writeU64(size);
  }
  header.writeU32(static_cast<std::uint32_t>(snapshot.frame_id.size()));
  header.writeBytes(snapshot.frame_id);
  header.writeU32(computeChecksum(header.bytes()));
  return header.take();
}

/// Magic number and version, which stand at the same place in all versions.
void checkKind(std::string_view bytes, ByteReader& reader) {
  if (!isNativeFormat(bytes)) {
    const bool is_start = !bytes.empty() && kMagic.substr(0, bytes.size()) == bytes;
    if (is_start) (void)reader.readBytes(kMagic.size());
    fail(MapFileDefect::kForeign,
         "is no map of cuboid_mapping: its first bytes are not those of the format");
  }
  (void)reader.readBytes(kMagic.size());
  const std::uint32_t version = reader.readU32();
  if (version > kNativeFormatVersion) {
    fail(MapFileDefect::kNewerVersion, "has version " + std::to_string(version) +
                                           " of the format, and this program reads up to " +
                                           std::to_string(kNativeFormatVersion) +
                                           ": update cuboid_mapping");
  }
  if (version == 0) failCorrupted("version 0 of the format does not exist");
}

Sizes decodeHeader(std::string_view bytes, ByteReader& reader, MapSnapshot& snapshot) {
  checkKind(bytes, reader);
  const std::uint32_t environment = reader.readU32();
  SensorModelConfig& model = snapshot.sensor_model;
  for (double* value :
       {&snapshot.resolution_m, &model.hit, &model.miss, &model.alpha_min, &model.alpha_max}) {
    *value = reader.readF64();
  }
  Sizes sizes{};
  for (std::uint64_t* size :
       {&sizes.num_cuboids, &sizes.num_log_odds, &sizes.payload_bytes, &sizes.compressed_bytes}) {
    *size = reader.readU64();
  }
  const std::uint32_t frame_id_bytes = reader.readU32();
  if (frame_id_bytes > kMaxFrameIdBytes) failCorrupted("the name of its frame is too long");
  snapshot.frame_id = reader.readBytes(frame_id_bytes);
  const std::size_t end = reader.position();
  if (reader.readU32() != computeChecksum(bytes.substr(0, end))) {
    failCorrupted("the checksum of its header is wrong");
  }
  if (environment > 1) failCorrupted("it names an environment that does not exist");
  snapshot.environment = environment == 1 ? Environment::kStatic : Environment::kDynamic;
  return sizes;
}

void checkClaims(const Sizes& sizes, const NativeFormatLimits& limits) {
  if (sizes.payload_bytes > limits.max_payload_bytes) {
    fail(MapFileDefect::kTooBig,
         "claims to hold " + std::to_string(sizes.payload_bytes) + " bytes, more than the " +
             std::to_string(limits.max_payload_bytes) + " that are read: it is damaged, or no map");
  }
  if (sizes.num_cuboids > sizes.payload_bytes / kColumns ||
      sizes.num_log_odds > sizes.num_cuboids) {
    fail(MapFileDefect::kTooBig, "claims " + std::to_string(sizes.num_cuboids) + " cuboids in " +
                                     std::to_string(sizes.payload_bytes) +
                                     " bytes, which cannot be: it is damaged, or no map");
  }
}

void decodePayload(const std::string& payload, const Sizes& sizes, std::vector<Cuboid>& cuboids) {
  ByteReader reader(payload);
  std::vector<float> log_odds(sizes.num_log_odds);
  for (float& value : log_odds) value = reader.readF32();
  cuboids.resize(sizes.num_cuboids);
  for (int axis = 0; axis < 3; ++axis) {
    std::int64_t coordinate = 0;
    for (Cuboid& cuboid : cuboids) {
      coordinate += fromZigzag(reader.readVarint());
      if (coordinate < -Grid::kMaxCell || coordinate >= Grid::kMaxCell) {
        failCorrupted("a cuboid lies outside of the cells of a map");
      }
      cuboid.box.min[axis] = static_cast<std::int32_t>(coordinate);
    }
  }
  for (int axis = 0; axis < 3; ++axis) {
    for (Cuboid& cuboid : cuboids) {
      const std::int64_t max = std::int64_t{cuboid.box.min[axis]} + reader.readVarint() + 1;
      if (max > Grid::kMaxCell) failCorrupted("a cuboid lies outside of the cells of a map");
      cuboid.box.max[axis] = static_cast<std::int32_t>(max);
    }
  }
  for (Cuboid& cuboid : cuboids) {
    const std::uint32_t index = reader.readVarint();
    if (index >= log_odds.size()) failCorrupted("a cuboid has no log-odds");
    cuboid.log_odds = log_odds[index];
  }
  if (reader.numLeft() != 0) failCorrupted("something follows its cuboids");
}

}  // namespace

bool isNativeFormat(std::string_view bytes) { return bytes.substr(0, kMagic.size()) == kMagic; }

std::string toNativeFormat(MapSnapshot snapshot) {
  sortCuboids(snapshot.cuboids);
  snapshot.frame_id.resize(std::min(snapshot.frame_id.size(), kMaxFrameIdBytes));
  const std::vector<float> log_odds = collectLogOdds(snapshot.cuboids);
  const std::string payload = encodePayload(snapshot.cuboids, log_odds);
  const std::string compressed = compress(payload);
  ByteWriter file;
  file.writeBytes(encodeHeader(
      snapshot, {snapshot.cuboids.size(), log_odds.size(), payload.size(), compressed.size()}));
  file.writeBytes(compressed);
  file.writeU32(computeChecksum(compressed));
  return file.take();
}

MapSnapshot fromNativeFormat(std::string_view bytes, const NativeFormatLimits& limits) {
  MapSnapshot snapshot;
  ByteReader reader(bytes);
  const Sizes sizes = decodeHeader(bytes, reader, snapshot);
  checkClaims(sizes, limits);
  const std::string_view compressed =
      reader.readBytes(std::min<std::uint64_t>(sizes.compressed_bytes, bytes.size() + 1));
  if (reader.readU32() != computeChecksum(compressed)) {
    failCorrupted("the checksum of its content is wrong");
  }
  if (reader.numLeft() != 0) failCorrupted("something follows its end");
  try {
    decodePayload(decompress(compressed, sizes.payload_bytes), sizes, snapshot.cuboids);
  } catch (const MapFileError& error) {
    // The file is complete, so what ends too early in it was never right.
    if (error.defect() == MapFileDefect::kTruncated) failCorrupted("its content ends too early");
    throw;
  }
  throwIfFaulty(snapshot, limits.snapshot);
  return snapshot;
}

}  // namespace cuboid_mapping
