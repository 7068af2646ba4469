// SPDX-License-Identifier: BSD-3-Clause
#include "mpi/cloud_parts.h"

#include "cuboid_mapping/io/byte_stream.h"

#include <algorithm>
#include <cstring>
#include <stdexcept>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::BrickMask;
using cuboid_mapping::BrickUpdate;
using cuboid_mapping::Cell;
using cuboid_mapping::kBrickEdge;

enum Slice : unsigned { kEmpty = 0, kFull = 1, kFollows = 2 };

constexpr std::size_t kMaxVarintBytes = 5;
constexpr std::size_t kMaxMaskBytes = 2 + sizeof(BrickMask);
constexpr std::size_t kMaxBrickBytes = 1 + 3 * kMaxVarintBytes + 3 * kMaxMaskBytes;
constexpr std::size_t kHeadBytes = 8;

// Numbers in this machine's format: all ranks run one program.
template <typename T>
void put(T value, char* at) {
  std::memcpy(at, &value, sizeof(value));
}

template <typename T>
T numberAt(const char* at) {
  T value;
  std::memcpy(&value, at, sizeof(value));
  return value;
}

/// Difference in bricks.
std::int32_t stepOf(const Cell& from, const Cell& to, int axis) {
  return to[axis] / kBrickEdge - from[axis] / kBrickEdge;
}

}  // namespace

void PartWriter::reserve(std::size_t num_bytes) {
  if (bytes_.size() - end_ < num_bytes)
    bytes_.resize(std::max(2 * bytes_.size(), end_ + num_bytes));
}

void PartWriter::beginCloud(std::size_t source) {
  reserve(kHeadBytes);
  begin_ = end_;
  last_ = {0, 0, 0};
  num_bricks_ = 0;
  put(static_cast<std::uint32_t>(source), &bytes_[end_]);
  put(num_bricks_, &bytes_[end_ + 4]);
  end_ += kHeadBytes;
}

void PartWriter::add(const BrickUpdate& brick) {
  reserve(kMaxBrickBytes);
  const BrickMask grazes = brick.grazes.without(brick.hits | brick.misses);
  const bool has_grazes = !grazes.isEmpty();
  bytes_[end_++] = static_cast<char>(has_grazes);
  for (int axis = 0; axis < 3; ++axis) {
    writeVarint(cuboid_mapping::toZigzag(stepOf(last_, brick.brick, axis)));
  }
  last_ = brick.brick;
  writeMask(brick.hits);
  writeMask(brick.misses.without(brick.hits));
  if (has_grazes) writeMask(grazes);
  put(++num_bricks_, &bytes_[begin_ + 4]);
}

void PartWriter::writeVarint(std::uint32_t value) {
  for (; value >= 0x80; value >>= 7) bytes_[end_++] = static_cast<char>(value | 0x80);
  bytes_[end_++] = static_cast<char>(value);
}

void PartWriter::writeMask(const BrickMask& mask) {
  char* const kinds_at = &bytes_[end_];
  char* next = kinds_at + 2;
  unsigned kinds = 0;
  for (int z = 0; z < kBrickEdge; ++z) {
    const std::uint64_t slice = mask[z];
    const unsigned kind = slice == 0 ? kEmpty : ~slice == 0 ? kFull : kFollows;
    kinds |= kind << 2 * z;
    put(slice, next);  // Without a branch: a slice that is not needed is overwritten.
    next += kind == kFollows ? sizeof(slice) : 0;
  }
  put(static_cast<std::uint16_t>(kinds), kinds_at);
  end_ = static_cast<std::size_t>(next - bytes_.data());
}

std::size_t PartReader::read(std::vector<BrickUpdate>& bricks) {
  const std::uint32_t source = readU32();
  const std::uint32_t num_bricks = readU32();
  if (num_bricks > bytes_.size()) throw std::runtime_error("a part of a cloud ends too early");
  bricks.resize(num_bricks);
  Cell cell{0, 0, 0};
  for (BrickUpdate& brick : bricks) {
    const bool has_grazes = *take(1) != 0;
    for (int axis = 0; axis < 3; ++axis) {
      cell[axis] += kBrickEdge * cuboid_mapping::fromZigzag(readVarint());
    }
    brick.brick = cell;
    readMask(brick.hits);
    readMask(brick.misses);
    brick.grazes = {};
    if (has_grazes) readMask(brick.grazes);
  }
  return source;
}

const char* PartReader::take(std::size_t num_bytes) {
  if (num_bytes > bytes_.size()) throw std::runtime_error("a part of a cloud ends too early");
  const char* const at = bytes_.data();
  bytes_.remove_prefix(num_bytes);
  return at;
}

std::uint32_t PartReader::readU32() { return numberAt<std::uint32_t>(take(4)); }

std::uint32_t PartReader::readVarint() {
  std::uint32_t value = 0;
  for (unsigned shift = 0; shift < 35; shift += 7) {
    const auto byte = static_cast<unsigned char>(*take(1));
    value |= (byte & 0x7FU) << shift;
    if (byte < 0x80) break;
  }
  return value;
}

void PartReader::readMask(BrickMask& mask) {
  const unsigned kinds = numberAt<std::uint16_t>(take(2));
  for (int z = 0; z < kBrickEdge; ++z) {
    const unsigned kind = kinds >> 2 * z & 3;
    mask[z] = kind == kFollows ? numberAt<std::uint64_t>(take(sizeof(std::uint64_t)))
              : kind == kFull  ? ~std::uint64_t{0}
                               : 0;
  }
}

}  // namespace cuboid_mapping_ros
