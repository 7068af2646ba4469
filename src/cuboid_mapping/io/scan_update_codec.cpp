// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/io/scan_update_codec.h"

#include "cuboid_mapping/io/brick_codec.h"
#include "cuboid_mapping/io/compression.h"
#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/scan/morton.h"

#include <algorithm>

namespace cuboid_mapping {
namespace {

/// A format: its magic number, and what it has.
struct UpdateFormat {
  std::uint32_t magic;
  bool has_cells;  ///< Bricks are cells; in old formats, numbers on a Morton curve.
  bool has_grazes;
};
constexpr UpdateFormat kUpdateFormats[] = {{0x31534243, false, false},  // "CBS1"
                                           {0x32534243, false, true},   // "CBS2"
                                           {0x33534243, true, false},   // "CBS3"
                                           {0x34534243, true, true}};   // "CBS4"
constexpr int kFast = 1;
/// Bits on each axis of a number on a Morton curve.
constexpr int kNumberBits = 21;
/// Largest size of an item before compression.
constexpr std::uint64_t kMaxItemBytes = 3 * sizeof(BrickMask) + 15;
/// Size of the counts, and of the cell from which old formats number bricks.
constexpr std::uint64_t kMaxFixedBytes = 64;

void writeCell(const Cell& cell, ByteWriter& payload) {
  for (int axis = 0; axis < 3; ++axis) payload.writeVarint(toZigzag(cell[axis]));
}

Cell readCell(ByteReader& payload) {
  Cell cell;
  for (int axis = 0; axis < 3; ++axis) cell[axis] = fromZigzag(payload.readVarint());
  return cell;
}

const UpdateFormat& formatOf(const ScanUpdate& update) {
  const bool has_grazes =
      std::any_of(update.bricks.begin(), update.bricks.end(), [](const BrickUpdate& brick) {
        return !brick.grazes.without(brick.hits | brick.misses).isEmpty();
      });
  return kUpdateFormats[has_grazes ? 3 : 2];
}

const UpdateFormat* formatOf(std::uint32_t magic) {
  for (const UpdateFormat& format : kUpdateFormats) {
    if (format.magic == magic) return &format;
  }
  return nullptr;
}

/// Writes column by column, which zstd compresses best.
std::string encodeBricks(const ScanUpdate& update, const UpdateFormat& format) {
  ByteWriter payload;
  payload.writeVarint(update.num_points);
  payload.writeVarint(update.num_out_of_range);
  payload.writeVarint(update.num_too_far);
  for (int axis = 0; axis < 3; ++axis) {
    DifferenceWriter numbers(payload);
    for (const BrickUpdate& brick : update.bricks) numbers.write(brick.brick[axis] / kBrickEdge);
  }
  for (const BrickUpdate& brick : update.bricks) writeMask(brick.hits, payload);
  for (const BrickUpdate& brick : update.bricks) {
    writeMask(brick.misses.without(brick.hits), payload);
  }
  if (format.has_grazes) {
    for (const BrickUpdate& brick : update.bricks) {
      writeMask(brick.grazes.without(brick.hits | brick.misses), payload);
    }
  }
  for (const Cell& sample : update.samples) writeCell(sample, payload);
  return payload.take();
}

void readBricks(ByteReader& payload, std::vector<BrickUpdate>& bricks) {
  for (int axis = 0; axis < 3; ++axis) {
    DifferenceReader numbers(payload);
    for (BrickUpdate& brick : bricks) brick.brick[axis] = numbers.readBrickPlace();
  }
}

/// The bricks of an old format: gaps between the numbers on a Morton curve that begins at a cell.
void readNumberedBricks(ByteReader& payload, std::vector<BrickUpdate>& bricks) {
  constexpr std::uint64_t kEnd = std::uint64_t{1} << (3 * kNumberBits);
  const Cell base = readCell(payload);
  std::uint64_t next = 0;
  for (BrickUpdate& brick : bricks) {
    const std::uint64_t gap = payload.readVarint64();
    if (next >= kEnd || gap >= kEnd - next) failCorrupted("a brick has no number");
    const std::uint64_t number = next + gap;
    for (int axis = 0; axis < 3; ++axis) {
      const auto from_base = static_cast<std::int64_t>(gatherBits(number >> axis)) * kBrickEdge;
      brick.brick[axis] = toBrickPlace(base[axis] + from_base);
    }
    next = number + 1;
  }
}

/// The header before the content.
struct Head {
  UpdateFormat format;
  std::size_t num_bricks;
  std::size_t num_samples;

  [[nodiscard]] std::uint64_t numItems() const { return num_bricks + num_samples; }
  [[nodiscard]] std::uint64_t leastBytes() const {
    return (format.has_grazes ? 3 : 2) * sizeof(BrickMask) * num_bricks + 3 * num_samples;
  }
};

ScanUpdate decodeUpdate(std::string_view bytes, const Head& head) {
  ByteReader payload(bytes);
  ScanUpdate update;
  update.num_points = payload.readVarint64();
  update.num_out_of_range = payload.readVarint64();
  update.num_too_far = payload.readVarint64();
  update.bricks.resize(head.num_bricks);
  (head.format.has_cells ? readBricks : readNumberedBricks)(payload, update.bricks);
  for (BrickUpdate& brick : update.bricks) brick.hits = readMask(payload);
  for (BrickUpdate& brick : update.bricks) brick.misses = readMask(payload);
  if (head.format.has_grazes) {
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
  const UpdateFormat& format = formatOf(update);
  const std::string payload = encodeBricks(update, format);
  ByteWriter bytes;
  bytes.writeU32(format.magic);
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
    const UpdateFormat* format = formatOf(reader.readU32());
    if (format == nullptr) return std::nullopt;
    Head head{*format, 0, 0};
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
