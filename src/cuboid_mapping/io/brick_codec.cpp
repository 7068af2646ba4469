// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/io/brick_codec.h"

#include <zlib.h>

#include <cstring>
#include <stdexcept>
#include <string>
#include <unordered_map>

namespace cuboid_mapping {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr std::size_t kBrickBytes = 3 * sizeof(std::int32_t) + sizeof(std::uint16_t);
constexpr std::size_t kCuboidBytes = 7;
/// A message that claims to hold more is damaged.
constexpr std::size_t kMaxBytes = std::size_t{1} << 30;

/// Bytes of a number of one of so many values.
std::size_t numberBytes(std::size_t num_values) {
  std::size_t num_bytes = 1;
  while (num_bytes < sizeof(std::uint32_t) && num_values > std::size_t{1} << (8 * num_bytes)) {
    ++num_bytes;
  }
  return num_bytes;
}

template <typename T>
void append(const std::vector<T>& from, Bytes& bytes) {
  const std::size_t begin = bytes.size();
  bytes.resize(begin + from.size() * sizeof(T));
  if (!from.empty()) std::memcpy(&bytes[begin], from.data(), from.size() * sizeof(T));
}

/// Takes as many numbers as there are places from the bytes at `next`, and moves it on.
template <typename T>
void take(const Bytes& bytes, std::size_t& next, std::vector<T>& to) {
  if (!to.empty()) std::memcpy(to.data(), &bytes[next], to.size() * sizeof(T));
  next += to.size() * sizeof(T);
}

void appendValues(const std::vector<float>& log_odds, std::vector<float>& values, Bytes& bytes) {
  std::unordered_map<float, std::uint32_t> numbers;
  std::vector<std::uint32_t> number_of;
  number_of.reserve(log_odds.size());
  for (const float value : log_odds) {
    const auto [entry, is_new] = numbers.emplace(value, static_cast<std::uint32_t>(numbers.size()));
    if (is_new) values.push_back(value);
    number_of.push_back(entry->second);
  }
  for (std::size_t byte = 0; byte < numberBytes(values.size()); ++byte) {
    for (const std::uint32_t number : number_of) {
      bytes.push_back(static_cast<std::uint8_t>(number >> (8 * byte) & 0xFF));
    }
  }
}

Bytes deflateBytes(const Bytes& bytes) {
  uLongf size = compressBound(bytes.size());
  Bytes packed(size);
  // Cannot fail: there is room, and the level exists.
  compress2(packed.data(), &size, bytes.data(), bytes.size(), Z_BEST_SPEED);
  packed.resize(size);
  return packed;
}

/// Before they are deflated, and with up to 65,536 different values.
std::size_t bytesOf(std::size_t num_bricks, std::size_t num_cuboids, std::size_t num_values) {
  return kBrickBytes * num_bricks + kCuboidBytes * num_cuboids + sizeof(std::uint16_t) * num_values;
}

/// roscpp drops a message of 1 GB without a word, and a listener takes it for damaged.
void requireFits(const BrickArrays& arrays) {
  const std::size_t num_bytes =
      bytesOf(arrays.counts.size(), arrays.occupied.size(), arrays.values.size());
  if (num_bytes <= kMaxBytes) return;
  throw std::length_error("too much for a message: " + std::to_string(num_bytes / 1000000) +
                          " MB, of at most " + std::to_string(kMaxBytes / 1000000) +
                          ". Let classes travel alone (publish_values: false)");
}

/// Grows with what is really there, so that a claim alone takes no memory. Empty when it is damaged.
Bytes inflateBytes(const Bytes& packed) {
  z_stream stream{};
  if (inflateInit(&stream) != Z_OK) return {};
  stream.next_in = const_cast<Bytef*>(packed.data());
  stream.avail_in = static_cast<uInt>(packed.size());
  Bytes bytes;
  int state = Z_OK;
  while (state == Z_OK && bytes.size() <= kMaxBytes) {
    constexpr std::size_t kStep_bytes = std::size_t{1} << 18;
    const std::size_t begin = bytes.size();
    bytes.resize(begin + kStep_bytes);
    stream.next_out = &bytes[begin];
    stream.avail_out = kStep_bytes;
    state = inflate(&stream, Z_NO_FLUSH);
    bytes.resize(begin + kStep_bytes - stream.avail_out);
  }
  const bool is_whole = state == Z_STREAM_END && stream.avail_in == 0;
  inflateEnd(&stream);
  return is_whole ? bytes : Bytes();
}

/// What follows the cuboids. @return false when a number names no value.
bool takeValues(const Bytes& bytes, std::size_t next, const std::vector<float>& values,
                std::vector<float>& log_odds) {
  const std::size_t num_bytes = numberBytes(values.size());
  if ((bytes.size() - next) % num_bytes != 0) return false;
  const std::size_t num_voxels = (bytes.size() - next) / num_bytes;
  log_odds.resize(num_voxels);
  for (std::size_t i = 0; i < num_voxels; ++i) {
    std::size_t number = 0;
    for (std::size_t byte = 0; byte < num_bytes; ++byte) {
      number |= std::size_t{bytes[next + byte * num_voxels + i]} << (8 * byte);
    }
    if (number >= values.size()) return false;
    log_odds[i] = values[number];
  }
  return true;
}

/// Voxels of a cuboid. @param bounds  Its six.
std::size_t numVoxels(const std::uint8_t* bounds) {
  std::size_t count = 1;
  for (int axis = 0; axis < 3; ++axis) count *= std::size_t{bounds[axis + 3]} - bounds[axis];
  return count;
}

template <typename T>
void appendRange(const std::vector<T>& from, std::size_t begin, std::size_t end,
                 std::vector<T>& to) {
  const auto first = from.begin();
  to.insert(to.end(), first + static_cast<std::ptrdiff_t>(begin),
            first + static_cast<std::ptrdiff_t>(end));
}

}  // namespace

BrickArrays BrickSplitter::next() {
  const std::size_t first_brick = brick_;
  const std::size_t first_cuboid = cuboid_;
  const std::size_t first_value = value_;
  for (std::size_t num_bytes = 0; brick_ < all_.counts.size(); ++brick_) {
    const std::size_t end = cuboid_ + all_.counts[brick_];
    std::size_t num_values = 0;
    for (std::size_t i = cuboid_; all_.has_values && i < end; ++i) {
      num_values += numVoxels(&all_.bounds[6 * i]);
    }
    num_bytes += bytesOf(1, all_.counts[brick_], num_values);
    if (num_bytes > max_bytes_ && brick_ > first_brick) break;
    cuboid_ = end;
    value_ += num_values;
  }
  BrickArrays part;
  part.has_values = all_.has_values;
  appendRange(all_.bricks, 3 * first_brick, 3 * brick_, part.bricks);
  appendRange(all_.counts, first_brick, brick_, part.counts);
  appendRange(all_.bounds, 6 * first_cuboid, 6 * cuboid_, part.bounds);
  appendRange(all_.occupied, first_cuboid, cuboid_, part.occupied);
  appendRange(all_.values, first_value, value_, part.values);
  return part;
}

void appendBricks(const BrickArrays& from, BrickArrays& to) {
  appendRange(from.bricks, 0, from.bricks.size(), to.bricks);
  appendRange(from.counts, 0, from.counts.size(), to.counts);
  appendRange(from.bounds, 0, from.bounds.size(), to.bounds);
  appendRange(from.occupied, 0, from.occupied.size(), to.occupied);
  appendRange(from.values, 0, from.values.size(), to.values);
}

PackedBricks packBricks(const BrickArrays& arrays) {
  requireFits(arrays);
  PackedBricks packed;
  packed.num_bricks = static_cast<std::uint32_t>(arrays.counts.size());
  packed.num_cuboids = static_cast<std::uint32_t>(arrays.occupied.size());
  packed.has_values = arrays.has_values;
  Bytes bytes;
  append(arrays.bricks, bytes);
  append(arrays.counts, bytes);
  append(arrays.bounds, bytes);
  append(arrays.occupied, bytes);
  if (arrays.has_values) appendValues(arrays.values, packed.values, bytes);
  packed.data = deflateBytes(bytes);
  return packed;
}

bool unpackBricks(const PackedBricks& packed, BrickArrays& arrays) {
  const Bytes bytes = inflateBytes(packed.data);
  const std::size_t size = packed.num_bricks * kBrickBytes + packed.num_cuboids * kCuboidBytes;
  if (bytes.size() < size || (!packed.has_values && bytes.size() != size)) return false;
  arrays.bricks.resize(std::size_t{3} * packed.num_bricks);
  arrays.counts.resize(packed.num_bricks);
  arrays.bounds.resize(std::size_t{6} * packed.num_cuboids);
  arrays.occupied.resize(packed.num_cuboids);
  arrays.has_values = packed.has_values;
  arrays.values.clear();
  std::size_t next = 0;
  take(bytes, next, arrays.bricks);
  take(bytes, next, arrays.counts);
  take(bytes, next, arrays.bounds);
  take(bytes, next, arrays.occupied);
  return !packed.has_values || takeValues(bytes, next, packed.values, arrays.values);
}

}  // namespace cuboid_mapping
