// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/io/native_format.h"

#include "cuboid_mapping/io/brick_codec.h"
#include "cuboid_mapping/io/compression.h"

#include <algorithm>

namespace cuboid_mapping {
namespace {

constexpr std::string_view kMagic(
    "\x89"
    "CUB\r\n\x1a\n",
    8);
/// Versions of maps without locks and without fused cuboids, which older programs can read.
constexpr std::uint32_t kVersionOfVoxels = 2;
constexpr std::uint32_t kVersionOfLocks = 3;
constexpr std::size_t kMaxFrameIdBytes = 255;
constexpr int kCompressionLevel = 3;
/// Minimum size of a box before compression: one byte for each column.
constexpr std::uint64_t kBoxBytes = 6;
/// Minimum size of a cuboid of version 1, with its log-odds.
constexpr std::uint64_t kCuboidBytes = kBoxBytes + 1;

[[noreturn]] void failWith(MapFileDefect defect, const std::string& text) {
  throw MapFileError(defect, text);
}

/// Their number; least cells, then sizes, axis by axis.
void encodeCountedBoxes(const std::vector<CellBox>& boxes, ByteWriter& payload) {
  payload.writeVarint(boxes.size());
  for (int axis = 0; axis < 3; ++axis) {
    DifferenceWriter coordinates(payload);
    for (const CellBox& box : boxes) coordinates.write(box.min[axis]);
  }
  for (int axis = 0; axis < 3; ++axis) {
    for (const CellBox& box : boxes) {
      payload.writeVarint(
          static_cast<std::uint32_t>(box.max[axis] - std::int64_t{box.min[axis]} - 1));
    }
  }
}

/// The fused cuboids of a class; all other cuboids of FusionKind::kGrowth are single cells.
std::vector<CellBox> fusedBoxes(const MapSnapshot& snapshot, Occupancy occupancy) {
  std::vector<CellBox> boxes;
  for (const Cuboid& cuboid : snapshot.cuboids) {
    if (cuboid.occupancy == occupancy && cuboid.box.numVoxels() > 1.0) boxes.push_back(cuboid.box);
  }
  return boxes;
}

/// Numbers of a header that are not part of a snapshot.
struct Sizes {
  std::uint64_t num_items;  ///< Bricks; in version 1, cuboids.
  std::uint64_t num_log_odds;
  std::uint64_t payload_bytes;
  std::uint64_t compressed_bytes;
};

constexpr Occupancy kClasses[] = {Occupancy::kOccupied, Occupancy::kFree};

std::string encodeHeader(const MapSnapshot& snapshot, std::uint32_t version, const Sizes& sizes) {
  ByteWriter header;
  header.writeBytes(kMagic);
  header.writeU32(version);
  header.writeU32(snapshot.environment == Environment::kStatic ? 1 : 0);
  const SensorModelConfig& model = snapshot.sensor_model;
  for (const double value :
       {snapshot.resolution_m, model.hit, model.miss, model.alpha_min, model.alpha_max}) {
    header.writeF64(value);
  }
  for (const std::uint64_t size :
       {sizes.num_items, sizes.num_log_odds, sizes.payload_bytes, sizes.compressed_bytes}) {
    header.writeU64(size);
  }
  const std::string frame_id = snapshot.frame_id.substr(0, kMaxFrameIdBytes);
  header.writeU32(static_cast<std::uint32_t>(frame_id.size()));
  header.writeBytes(frame_id);
  header.writeU32(computeChecksum(header.bytes()));
  return header.take();
}

/// Magic number and version, at the same place in all versions.
std::uint32_t readVersion(std::string_view bytes, ByteReader& reader) {
  if (bytes.substr(0, kMagic.size()) != kMagic) {
    const bool is_start = !bytes.empty() && kMagic.substr(0, bytes.size()) == bytes;
    if (is_start) (void)reader.readBytes(kMagic.size());
    failWith(MapFileDefect::kForeign,
             "is not a map of cuboid_mapping: it does not start with the format's magic number");
  }
  (void)reader.readBytes(kMagic.size());
  const std::uint32_t version = reader.readU32();
  if (version > kNativeFormatVersion) {
    failWith(MapFileDefect::kNewerVersion,
             "has version " + std::to_string(version) +
                 " of the format, but this program only reads versions up to " +
                 std::to_string(kNativeFormatVersion) + ": update cuboid_mapping");
  }
  if (version == 0) failCorrupted("version 0 of the format does not exist");
  return version;
}

/// The header after the version.
Sizes decodeHeader(std::string_view bytes, ByteReader& reader, MapSnapshot& snapshot) {
  const std::uint32_t environment = reader.readU32();
  SensorModelConfig& model = snapshot.sensor_model;
  for (double* value :
       {&snapshot.resolution_m, &model.hit, &model.miss, &model.alpha_min, &model.alpha_max}) {
    *value = reader.readF64();
  }
  Sizes sizes{};
  for (std::uint64_t* size :
       {&sizes.num_items, &sizes.num_log_odds, &sizes.payload_bytes, &sizes.compressed_bytes}) {
    *size = reader.readU64();
  }
  const std::uint32_t frame_id_bytes = reader.readU32();
  if (frame_id_bytes > kMaxFrameIdBytes) failCorrupted("its frame name is too long");
  snapshot.frame_id = reader.readBytes(frame_id_bytes);
  const std::size_t end = reader.position();
  if (reader.readU32() != computeChecksum(bytes.substr(0, end))) {
    failCorrupted("the checksum of its header does not match");
  }
  if (environment > 1) failCorrupted("its environment is unknown");
  snapshot.environment = environment == 1 ? Environment::kStatic : Environment::kDynamic;
  return sizes;
}

/// @param item_bytes  Minimum size of an item before compression.
void checkClaims(const Sizes& sizes, std::uint64_t item_bytes, const SnapshotLimits& limits) {
  if (sizes.payload_bytes > limits.max_bytes) {
    failWith(MapFileDefect::kTooBig,
             "claims to hold " + std::to_string(sizes.payload_bytes) + " bytes, more than the " +
                 std::to_string(limits.max_bytes) + " allowed: it is damaged, or not a map file");
  }
  // A cuboid of version 1 takes a part of the memory of a brick.
  const std::uint64_t max_items = limits.max_bricks * (item_bytes == kCuboidBytes ? 4 : 1);
  if (sizes.num_items > max_items) {
    failWith(MapFileDefect::kTooBig, "claims to hold " + std::to_string(sizes.num_items) +
                                         " bricks or cuboids, more than the " +
                                         std::to_string(max_items) + " allowed");
  }
  if (sizes.num_items > sizes.payload_bytes / item_bytes ||
      sizes.num_log_odds > sizes.payload_bytes / sizeof(float)) {
    failWith(MapFileDefect::kTooBig,
             "claims " + std::to_string(sizes.num_items) + " bricks or cuboids in " +
                 std::to_string(sizes.payload_bytes) +
                 " bytes, which is impossible: it is damaged, or not a map file");
  }
}

/// Inverse of encodeCountedBoxes() after the number. @param boxes  Has the right size.
void decodeBoxes(ByteReader& reader, std::vector<CellBox>& boxes) {
  for (int axis = 0; axis < 3; ++axis) {
    DifferenceReader coordinates(reader);
    for (CellBox& box : boxes) box.min[axis] = coordinates.read();
  }
  for (int axis = 0; axis < 3; ++axis) {
    for (CellBox& box : boxes) {
      const std::int64_t max = std::int64_t{box.min[axis]} + reader.readVarint() + 1;
      if (max > Grid::kMaxCell) failCorrupted("a box lies outside the limits of a map");
      box.max[axis] = static_cast<std::int32_t>(max);
    }
  }
}

std::vector<CellBox> decodeCountedBoxes(ByteReader& reader) {
  const std::uint32_t count = reader.readVarint();
  if (count > reader.numLeft() / kBoxBytes) failCorrupted("it claims too many boxes");
  std::vector<CellBox> boxes(count);
  decodeBoxes(reader, boxes);
  return boxes;
}

/// Cuboids of version 1, each with its own log-odds.
std::vector<UniformBox> decodeCuboids(ByteReader& reader, const Sizes& sizes) {
  const std::vector<float> log_odds = decodeLogOdds(sizes.num_log_odds, reader);
  std::vector<CellBox> boxes(sizes.num_items);
  decodeBoxes(reader, boxes);
  std::vector<UniformBox> cuboids;
  cuboids.reserve(boxes.size());
  for (const CellBox& box : boxes) cuboids.push_back({box, readLogOdds(log_odds, reader)});
  return cuboids;
}

}  // namespace

std::string toNativeFormat(const MapSnapshot& snapshot, const ProgressListener& listener) {
  ByteWriter payload;
  const VoxelBrick* const first = snapshot.bricks.data();
  const std::size_t num_log_odds =
      encodeBricks(first, first + snapshot.bricks.size(), true, payload, listener);
  const std::vector<CellBox> fused[] = {fusedBoxes(snapshot, kClasses[0]),
                                        fusedBoxes(snapshot, kClasses[1])};
  std::uint32_t version = snapshot.locked.empty() ? kVersionOfVoxels : kVersionOfLocks;
  if (!fused[0].empty() || !fused[1].empty()) version = kNativeFormatVersion;
  if (version >= kVersionOfLocks) encodeCountedBoxes(snapshot.locked, payload);
  if (version > kVersionOfLocks) {
    for (const std::vector<CellBox>& boxes : fused) encodeCountedBoxes(boxes, payload);
  }
  const std::string compressed = compress(payload.bytes(), kCompressionLevel);
  ByteWriter file;
  file.writeBytes(encodeHeader(
      snapshot, version,
      {snapshot.bricks.size(), num_log_odds, payload.bytes().size(), compressed.size()}));
  file.writeBytes(compressed);
  file.writeU32(computeChecksum(compressed));
  return file.take();
}

MapSnapshot fromNativeFormat(std::string_view bytes, const SnapshotLimits& limits) {
  MapSnapshot snapshot;
  ByteReader reader(bytes);
  const std::uint32_t version = readVersion(bytes, reader);
  const Sizes sizes = decodeHeader(bytes, reader, snapshot);
  checkClaims(sizes, version == 1 ? kCuboidBytes : kLeastBrickBytes, limits);
  const std::string_view compressed =
      reader.readBytes(std::min<std::uint64_t>(sizes.compressed_bytes, bytes.size() + 1));
  if (reader.readU32() != computeChecksum(compressed)) {
    failCorrupted("the checksum of its content does not match");
  }
  if (reader.numLeft() != 0) failCorrupted("there is more data after its end");
  try {
    const std::string payload = decompress(compressed, sizes.payload_bytes);
    ByteReader content(payload);
    snapshot.bricks = version == 1
                          ? bricksOf(decodeCuboids(content, sizes), limits)
                          : decodeBricks(sizes.num_items, sizes.num_log_odds, true, content);
    if (version >= kVersionOfLocks) snapshot.locked = decodeCountedBoxes(content);
    if (version > kVersionOfLocks) {
      for (const Occupancy occupancy : kClasses) {
        for (const CellBox& box : decodeCountedBoxes(content)) {
          snapshot.cuboids.push_back({box, occupancy});
        }
      }
    }
    if (content.numLeft() != 0) failCorrupted("there is more data after its content");
  } catch (const MapFileError& error) {
    // The file is complete, so content that ends too early was never valid.
    if (error.defect() == MapFileDefect::kTruncated) failCorrupted("its content ends too early");
    throw;
  }
  throwIfFaulty(snapshot, limits);
  return snapshot;
}

}  // namespace cuboid_mapping
