// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/delta_codec.h"

#include <zlib.h>

#include <cstring>
#include <unordered_map>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::MapDelta;

constexpr std::size_t kBoxBytes = 6 * sizeof(std::int32_t) + sizeof(std::uint32_t);
/// Six offsets, and the number of the value in two bytes.
constexpr std::size_t kCuboidBytes = 8;
constexpr std::size_t kMaxValues = 65536;
/// A message that claims to hold more is damaged.
constexpr std::size_t kMaxBytes = std::size_t{1} << 30;

template <typename T>
void append(const std::vector<T>& from, std::vector<std::uint8_t>& bytes) {
  const std::size_t begin = bytes.size();
  bytes.resize(begin + from.size() * sizeof(T));
  if (!from.empty()) std::memcpy(&bytes[begin], from.data(), from.size() * sizeof(T));
}

/// Takes as many numbers as there are places from the bytes at `next`, and moves it on.
template <typename T>
void take(const std::vector<std::uint8_t>& bytes, std::size_t& next, std::vector<T>& to) {
  if (!to.empty()) std::memcpy(to.data(), &bytes[next], to.size() * sizeof(T));
  next += to.size() * sizeof(T);
}

std::vector<std::uint8_t> deflateBytes(const std::vector<std::uint8_t>& bytes) {
  uLongf size = compressBound(bytes.size());
  std::vector<std::uint8_t> packed(size);
  // Cannot fail: there is room, and the level exists.
  compress2(packed.data(), &size, bytes.data(), bytes.size(), Z_BEST_SPEED);
  packed.resize(size);
  return packed;
}

}  // namespace

std::optional<PackedDelta> packArrays(const MapDelta& delta) {
  PackedDelta packed;
  packed.num_boxes = static_cast<std::uint32_t>(delta.counts.size());
  packed.num_cuboids = static_cast<std::uint32_t>(delta.log_odds.size());
  std::unordered_map<float, std::size_t> numbers;
  std::vector<std::uint8_t> low;
  std::vector<std::uint8_t> high;
  low.reserve(delta.log_odds.size());
  high.reserve(delta.log_odds.size());
  for (const float log_odds : delta.log_odds) {
    const auto [entry, is_new] = numbers.emplace(log_odds, numbers.size());
    if (is_new) packed.values.push_back(log_odds);
    low.push_back(static_cast<std::uint8_t>(entry->second & 0xFF));
    high.push_back(static_cast<std::uint8_t>(entry->second >> 8));
  }
  if (packed.values.size() > kMaxValues) return std::nullopt;
  std::vector<std::uint8_t> bytes;
  append(delta.boxes, bytes);
  append(delta.counts, bytes);
  append(delta.offsets, bytes);
  append(low, bytes);
  append(high, bytes);
  packed.data = deflateBytes(bytes);
  return packed;
}

bool unpackArrays(const PackedDelta& packed, MapDelta& delta) {
  const std::size_t size = packed.num_boxes * kBoxBytes + packed.num_cuboids * kCuboidBytes;
  if (size > kMaxBytes) return false;
  std::vector<std::uint8_t> bytes(size);
  uLongf unpacked_size = size;
  std::uint8_t nothing = 0;
  std::uint8_t* const target = size > 0 ? bytes.data() : &nothing;
  if (uncompress(target, &unpacked_size, packed.data.data(), packed.data.size()) != Z_OK ||
      unpacked_size != size) {
    return false;
  }
  delta.boxes.resize(std::size_t{6} * packed.num_boxes);
  delta.counts.resize(packed.num_boxes);
  delta.offsets.resize(std::size_t{6} * packed.num_cuboids);
  std::vector<std::uint8_t> low(packed.num_cuboids);
  std::vector<std::uint8_t> high(packed.num_cuboids);
  std::size_t next = 0;
  take(bytes, next, delta.boxes);
  take(bytes, next, delta.counts);
  take(bytes, next, delta.offsets);
  take(bytes, next, low);
  take(bytes, next, high);
  delta.log_odds.clear();
  delta.log_odds.reserve(packed.num_cuboids);
  for (std::size_t i = 0; i < low.size(); ++i) {
    const std::size_t number = low[i] | static_cast<std::size_t>(high[i]) << 8;
    if (number >= packed.values.size()) return false;
    delta.log_odds.push_back(packed.values[number]);
  }
  return true;
}

}  // namespace cuboid_mapping_ros
