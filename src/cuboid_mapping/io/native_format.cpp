// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/io/native_format.h"

#include "cuboid_mapping/io/byte_stream.h"
#include "cuboid_mapping/io/compression.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <unordered_set>

namespace cuboid_mapping {
namespace {

constexpr std::string_view kMagic(
    "\x89"
    "CUB\r\n\x1a\n",
    8);
/// The same format: a map without locks can be read by older programs.
constexpr std::uint32_t kVersionWithoutLocks = 2;
constexpr std::size_t kMaxFrameIdBytes = 255;
constexpr int kCompressionLevel = 3;
/// Bytes of a box before compression, at least: one for each column.
constexpr std::uint64_t kBoxBytes = 6;
/// The same of a cuboid of version 1, with its log-odds.
constexpr std::uint64_t kCuboidBytes = kBoxBytes + 1;
/// Bytes of a brick before compression, at least: its place, its mask, and a voxel.
constexpr std::uint64_t kBrickBytes = 3 + sizeof(BrickMask) + 1;

[[noreturn]] void failWith(MapFileDefect defect, const std::string& text) {
  throw MapFileError(defect, text);
}

std::vector<float> collectLogOdds(const std::vector<VoxelBrick>& bricks) {
  std::unordered_set<float> values;
  for (const VoxelBrick& brick : bricks) {
    brick.voxels.forEachValue([&](float log_odds, const BrickMask&) { values.insert(log_odds); });
  }
  std::vector<float> sorted(values.begin(), values.end());
  std::sort(sorted.begin(), sorted.end());
  return sorted;
}

/// Least cells, then sizes, axis by axis.
void encodeBoxes(const std::vector<CellBox>& boxes, ByteWriter& payload) {
  for (int axis = 0; axis < 3; ++axis) {
    std::int32_t previous = 0;
    for (const CellBox& box : boxes) {
      payload.writeVarint(toZigzag(box.min[axis] - previous));
      previous = box.min[axis];
    }
  }
  for (int axis = 0; axis < 3; ++axis) {
    for (const CellBox& box : boxes) {
      payload.writeVarint(
          static_cast<std::uint32_t>(box.max[axis] - std::int64_t{box.min[axis]} - 1));
    }
  }
}

std::string encodePayload(const MapSnapshot& snapshot, const std::vector<float>& log_odds) {
  const std::vector<VoxelBrick>& bricks = snapshot.bricks;
  ByteWriter payload;
  for (const float value : log_odds) payload.writeF32(value);
  for (int axis = 0; axis < 3; ++axis) {
    std::int32_t previous = 0;
    for (const VoxelBrick& brick : bricks) {
      const std::int32_t number = brick.brick[axis] / kBrickEdge;
      payload.writeVarint(toZigzag(number - previous));
      previous = number;
    }
  }
  for (const VoxelBrick& brick : bricks) {
    for (int z = 0; z < kBrickEdge; ++z) payload.writeU64(brick.voxels.known()[z]);
  }
  std::array<std::uint32_t, kBrickVoxels> places{};
  for (const VoxelBrick& brick : bricks) {
    brick.voxels.forEachValue([&](float value, const BrickMask& voxels) {
      const auto place = std::lower_bound(log_odds.begin(), log_odds.end(), value);
      const auto number = static_cast<std::uint32_t>(place - log_odds.begin());
      voxels.forEach([&](int voxel) { places[static_cast<std::size_t>(voxel)] = number; });
    });
    brick.voxels.known().forEach(
        [&](int voxel) { payload.writeVarint(places[static_cast<std::size_t>(voxel)]); });
  }
  if (!snapshot.locked.empty()) {
    payload.writeVarint(snapshot.locked.size());
    encodeBoxes(snapshot.locked, payload);
  }
  return payload.take();
}

/// The numbers of a header that a snapshot does not have.
struct Sizes {
  std::uint64_t num_items;  ///< Bricks; of version 1 cuboids.
  std::uint64_t num_log_odds;
  std::uint64_t payload_bytes;
  std::uint64_t compressed_bytes;
};

std::string encodeHeader(const MapSnapshot& snapshot, const Sizes& sizes) {
  ByteWriter header;
  header.writeBytes(kMagic);
  header.writeU32(snapshot.locked.empty() ? kVersionWithoutLocks : kNativeFormatVersion);
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

/// Magic number and version, which stand at the same place in all versions.
std::uint32_t readVersion(std::string_view bytes, ByteReader& reader) {
  if (!isNativeFormat(bytes)) {
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

/// What follows the version.
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

/// @param item_bytes  Of an item before compression, at least.
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

/// Reads numbers that are told by their differences.
class DifferenceReader {
 public:
  explicit DifferenceReader(ByteReader& reader) : reader_(reader) {}
  std::int32_t read() {
    number_ += fromZigzag(reader_.readVarint());
    if (number_ < -Grid::kMaxCell || number_ >= Grid::kMaxCell) {
      failCorrupted("it reaches beyond the limits of a map");
    }
    return static_cast<std::int32_t>(number_);
  }

 private:
  ByteReader& reader_;
  std::int64_t number_ = 0;
};

std::vector<float> decodeLogOdds(ByteReader& reader, const Sizes& sizes) {
  std::vector<float> log_odds(sizes.num_log_odds);
  for (float& value : log_odds) {
    value = reader.readF32();
    if (!std::isfinite(value)) failCorrupted("a voxel has log-odds that are not finite");
  }
  return log_odds;
}

float readLogOdds(ByteReader& reader, const std::vector<float>& log_odds) {
  const std::uint32_t index = reader.readVarint();
  if (index >= log_odds.size()) failCorrupted("a voxel refers to log-odds that are not there");
  return log_odds[index];
}

std::vector<VoxelBrick> decodeBricks(ByteReader& reader, const Sizes& sizes) {
  const std::vector<float> log_odds = decodeLogOdds(reader, sizes);
  std::vector<VoxelBrick> bricks(sizes.num_items);
  for (int axis = 0; axis < 3; ++axis) {
    DifferenceReader numbers(reader);
    for (VoxelBrick& brick : bricks) {
      const std::int64_t coordinate = std::int64_t{numbers.read()} * kBrickEdge;
      if (coordinate < -Grid::kMaxCell || coordinate >= Grid::kMaxCell) {
        failCorrupted("a brick lies outside the limits of a map");
      }
      brick.brick[axis] = static_cast<std::int32_t>(coordinate);
    }
  }
  std::vector<BrickMask> known(bricks.size());
  for (BrickMask& mask : known) {
    for (int z = 0; z < kBrickEdge; ++z) mask[z] = reader.readU64();
  }
  for (std::size_t i = 0; i < bricks.size(); ++i) {
    VoxelValues values;
    known[i].forEach([&](int voxel) {
      values[static_cast<std::size_t>(voxel)] = readLogOdds(reader, log_odds);
    });
    bricks[i].voxels = PackedVoxels(known[i], values);
  }
  return bricks;
}

/// Inverse of encodeBoxes(). @param boxes  As many as there are.
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

std::vector<CellBox> decodeLocks(ByteReader& reader) {
  const std::uint32_t count = reader.readVarint();
  if (count > reader.numLeft() / kBoxBytes) failCorrupted("it claims too many locked boxes");
  std::vector<CellBox> boxes(count);
  decodeBoxes(reader, boxes);
  return boxes;
}

/// Version 1 had cuboids, each with a log-odds of its own.
std::vector<UniformBox> decodeCuboids(ByteReader& reader, const Sizes& sizes) {
  const std::vector<float> log_odds = decodeLogOdds(reader, sizes);
  std::vector<CellBox> boxes(sizes.num_items);
  decodeBoxes(reader, boxes);
  std::vector<UniformBox> cuboids;
  cuboids.reserve(boxes.size());
  for (const CellBox& box : boxes) cuboids.push_back({box, readLogOdds(reader, log_odds)});
  return cuboids;
}

}  // namespace

bool isNativeFormat(std::string_view bytes) { return bytes.substr(0, kMagic.size()) == kMagic; }

std::string toNativeFormat(const MapSnapshot& snapshot) {
  const std::vector<float> log_odds = collectLogOdds(snapshot.bricks);
  const std::string payload = encodePayload(snapshot, log_odds);
  const std::string compressed = compress(payload, kCompressionLevel);
  ByteWriter file;
  file.writeBytes(encodeHeader(
      snapshot, {snapshot.bricks.size(), log_odds.size(), payload.size(), compressed.size()}));
  file.writeBytes(compressed);
  file.writeU32(computeChecksum(compressed));
  return file.take();
}

MapSnapshot fromNativeFormat(std::string_view bytes, const SnapshotLimits& limits) {
  MapSnapshot snapshot;
  ByteReader reader(bytes);
  const std::uint32_t version = readVersion(bytes, reader);
  const Sizes sizes = decodeHeader(bytes, reader, snapshot);
  checkClaims(sizes, version == 1 ? kCuboidBytes : kBrickBytes, limits);
  const std::string_view compressed =
      reader.readBytes(std::min<std::uint64_t>(sizes.compressed_bytes, bytes.size() + 1));
  if (reader.readU32() != computeChecksum(compressed)) {
    failCorrupted("the checksum of its content does not match");
  }
  if (reader.numLeft() != 0) failCorrupted("there is more data after its end");
  try {
    const std::string payload = decompress(compressed, sizes.payload_bytes);
    ByteReader content(payload);
    snapshot.bricks = version == 1 ? bricksOf(decodeCuboids(content, sizes), limits)
                                   : decodeBricks(content, sizes);
    if (version > kVersionWithoutLocks) snapshot.locked = decodeLocks(content);
    if (content.numLeft() != 0) failCorrupted("there is more data after its content");
  } catch (const MapFileError& error) {
    // The file is complete, so what ends too early in it was never right.
    if (error.defect() == MapFileDefect::kTruncated) failCorrupted("its content ends too early");
    throw;
  }
  throwIfFaulty(snapshot, limits);
  return snapshot;
}

}  // namespace cuboid_mapping
