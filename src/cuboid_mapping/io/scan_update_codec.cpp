// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/io/scan_update_codec.h"

#include "cuboid_mapping/io/brick_codec.h"
#include "cuboid_mapping/io/compression.h"
#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/scan/morton.h"

#include <algorithm>

namespace cuboid_mapping {
namespace {

/// Magic numbers of the formats without and with grazes. All others are refused.
///@{
constexpr std::uint32_t kUpdateMagic = 0x31534243;      // "CBS1"
constexpr std::uint32_t kMagicWithGrazes = 0x32534243;  // "CBS2"
///@}
constexpr int kFast = 1;
/// Largest size of an item before compression.
constexpr std::uint64_t kMaxItemBytes = 3 * sizeof(BrickMask) + 9;
/// Size of the counts and of the cell from which bricks are numbered.
constexpr std::uint64_t kMaxFixedBytes = 64;

void writeCell(const Cell& cell, ByteWriter& payload) {
  for (int axis = 0; axis < 3; ++axis) payload.writeVarint(toZigzag(cell[axis]));
}

Cell readCell(ByteReader& payload) {
  Cell cell;
  for (int axis = 0; axis < 3; ++axis) cell[axis] = fromZigzag(payload.readVarint());
  return cell;
}

bool hasGrazes(const ScanUpdate& update) {
  return std::any_of(update.bricks.begin(), update.bricks.end(), [](const BrickUpdate& brick) {
    return !brick.grazes.without(brick.hits | brick.misses).isEmpty();
  });
}

/// Writes column by column, which zstd compresses best.
std::string encodeBricks(const ScanUpdate& update) {
  ByteWriter payload;
  payload.writeVarint(update.num_points);
  payload.writeVarint(update.num_out_of_range);
  payload.writeVarint(update.num_too_far);
  Cell base{0, 0, 0};
  if (!update.bricks.empty()) {
    base = update.bricks.front().brick - cellOfMorton(update.bricks.front().morton);
  }
  writeCell(base, payload);
  std::uint64_t next = 0;
  for (const BrickUpdate& brick : update.bricks) {
    payload.writeVarint(brick.morton - next);
    next = brick.morton + 1;
  }
  for (const BrickUpdate& brick : update.bricks) writeMask(brick.hits, payload);
  for (const BrickUpdate& brick : update.bricks) {
    writeMask(brick.misses.without(brick.hits), payload);
  }
  if (hasGrazes(update)) {
    for (const BrickUpdate& brick : update.bricks) {
      writeMask(brick.grazes.without(brick.hits | brick.misses), payload);
    }
  }
  for (const Cell& sample : update.samples) writeCell(sample, payload);
  return payload.take();
}

/// Brick of a number from a message. Computed in 64 bits, since damaged numbers may be of any size.
Cell checkedBrick(const Cell& base, std::uint64_t morton) {
  const Cell from_base = cellOfMorton(morton);
  Cell brick;
  for (int axis = 0; axis < 3; ++axis) {
    const std::int64_t place = std::int64_t{base[axis]} + from_base[axis];
    if (place % kBrickEdge != 0 || place < -Grid::kMaxCell || place >= Grid::kMaxCell) {
      failCorrupted("a brick lies outside the limits of a map");
    }
    brick[axis] = static_cast<std::int32_t>(place);
  }
  return brick;
}

/// The header before the content.
struct Head {
  bool has_grazes;
  std::size_t num_bricks;
  std::size_t num_samples;

  [[nodiscard]] std::uint64_t numItems() const { return num_bricks + num_samples; }
  [[nodiscard]] std::uint64_t leastBytes() const {
    return (has_grazes ? 3 : 2) * sizeof(BrickMask) * num_bricks + 3 * num_samples;
  }
};

ScanUpdate decodeUpdate(std::string_view bytes, const Head& head) {
  ByteReader payload(bytes);
  ScanUpdate update;
  update.num_points = payload.readVarint64();
  update.num_out_of_range = payload.readVarint64();
  update.num_too_far = payload.readVarint64();
  const Cell base = readCell(payload);
  update.bricks.resize(head.num_bricks);
  std::uint64_t next = 0;
  for (BrickUpdate& brick : update.bricks) {
    const std::uint64_t gap = payload.readVarint64();
    constexpr std::uint64_t kEnd = std::uint64_t{1} << (3 * kBrickKeyBits);
    if (next >= kEnd || gap >= kEnd - next) failCorrupted("a brick has no number");
    brick.morton = next + gap;
    brick.brick = checkedBrick(base, brick.morton);
    next = brick.morton + 1;
  }
  for (BrickUpdate& brick : update.bricks) brick.hits = readMask(payload);
  for (BrickUpdate& brick : update.bricks) brick.misses = readMask(payload);
  if (head.has_grazes) {
    for (BrickUpdate& brick : update.bricks) brick.grazes = readMask(payload);
  }
  if (std::any_of(update.bricks.begin(), update.bricks.end(),
                  [](const BrickUpdate& brick) { return isEmpty(brick); })) {
    failCorrupted("a brick is empty");
  }
  update.samples.resize(head.num_samples);
  for (Cell& sample : update.samples) {
    sample = readCell(payload);
    if (!kAllCells.contains(sample)) failCorrupted("a sample lies outside the limits of a map");
  }
  if (payload.numLeft() != 0) failCorrupted("there is more data after its content");
  return update;
}

}  // namespace

std::string toBytes(const ScanUpdate& update) {
  const std::string payload = encodeBricks(update);
  ByteWriter bytes;
  bytes.writeU32(hasGrazes(update) ? kMagicWithGrazes : kUpdateMagic);
  bytes.writeU32(static_cast<std::uint32_t>(update.bricks.size()));
  bytes.writeU32(static_cast<std::uint32_t>(update.samples.size()));
  bytes.writeU64(payload.size());
  bytes.writeBytes(compress(payload, kFast));
  bytes.writeU32(computeChecksum(bytes.bytes()));
  return bytes.take();
}

std::optional<ScanUpdate> scanUpdateOfBytes(std::string_view bytes, std::size_t max_items) {
  try {
    ByteReader reader(bytes);
    const std::uint32_t magic = reader.readU32();
    if (magic != kUpdateMagic && magic != kMagicWithGrazes) return std::nullopt;
    Head head{magic == kMagicWithGrazes, 0, 0};
    head.num_bricks = reader.readU32();
    head.num_samples = reader.readU32();
    const std::uint64_t payload_bytes = reader.readU64();
    if (head.numItems() > max_items ||
        payload_bytes > kMaxFixedBytes + head.numItems() * kMaxItemBytes ||
        payload_bytes < head.leastBytes() || reader.numLeft() < sizeof(std::uint32_t)) {
      return std::nullopt;
    }
    const std::string_view compressed = reader.readBytes(reader.numLeft() - sizeof(std::uint32_t));
    const std::size_t end = reader.position();
    if (reader.readU32() != computeChecksum(bytes.substr(0, end))) return std::nullopt;
    return decodeUpdate(decompress(compressed, payload_bytes), head);
  } catch (const MapFileError&) {
    return std::nullopt;
  }
}

}  // namespace cuboid_mapping
