// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/voxels/packed_voxels.h"

#include "cuboid_mapping/voxels/value_moves.h"

#include <algorithm>
#include <cmath>

namespace cuboid_mapping {
namespace {

thread_local std::uint64_t num_encoded = 0;

/// Number of planes for the numbers below `count`.
int numPlanesFor(int count) {
  int num_planes = 0;
  while (1 << num_planes < count) ++num_planes;
  return num_planes;
}

}  // namespace

PackedVoxels::Masks::Masks(const PackedVoxels& packed)
    : known(packed.known()), occupied(packed.occupied()), num_planes(packed.shape_.num_planes) {
  for (int i = 0; i < num_planes; ++i) {
    planes[static_cast<std::size_t>(i)] = packed.maskOf(packed.firstPlane() + i);
  }
}

/// Memory for any content of a brick.
struct PackedVoxels::Unpacked : Masks {
  std::array<ClassValues, 2> values;  ///< ClassValues of free and of occupied voxels.

  Unpacked() = default;
  /// Unpacks the masks alone.
  explicit Unpacked(const PackedVoxels& packed) : Masks(packed) {}
  void setValues(const PackedVoxels& packed) {
    const Shape& shape = packed.shape_;
    values[0].assign(packed.values(), shape.num_free_values);
    values[1].assign(packed.values() + shape.num_free_values, shape.num_occupied_values);
  }

  void flip(const BrickMask& voxels, int from, int to) {
    while (to >> num_planes != 0) planes[static_cast<std::size_t>(num_planes++)] = BrickMask();
    for (int i = 0; from >> i != to >> i; ++i) {
      if (((from ^ to) >> i & 1) != 0) planes[static_cast<std::size_t>(i)] ^= voxels;
    }
  }

  /// Gives voxels a log-odds. @param from  Number of their old one; 0 for unknown voxels.
  void set(const BrickMask& voxels, int from, int preferred, float log_odds) {
    const bool is_occupied = classify(log_odds) == Occupancy::kOccupied;
    flip(voxels, from, values[is_occupied ? 1 : 0].numberOf(log_odds, preferred));
    known |= voxels;
    occupied = is_occupied ? occupied | voxels : occupied.without(voxels);
  }

  /// Makes voxels unknown, and removes log-odds that no other voxel has.
  void clear(const BrickMask& voxels) {
    known = known.without(voxels);
    occupied = occupied.without(voxels);
    for (int i = 0; i < num_planes; ++i) planes[static_cast<std::size_t>(i)] &= known;
    for (const bool is_occupied : {false, true}) {
      ClassValues& of_class = values[is_occupied ? 1 : 0];
      const BrickMask left = is_occupied ? occupied : known.without(occupied);
      for (int i = 0; i < of_class.size(); ++i) {
        if (voxelsOf(i, left).isEmpty()) of_class.vacate(i);
      }
    }
    compact();
  }

  /// Gives vacant numbers to the last log-odds, and removes planes that are not needed any more.
  void compact() {
    for (const bool is_occupied : {false, true}) {
      ClassValues& of_class = values[is_occupied ? 1 : 0];
      const BrickMask voxels = is_occupied ? occupied : known.without(occupied);
      for (int i = 0; i < of_class.size(); ++i) {
        if (!std::isnan(of_class[i])) continue;
        float last = kVacant;
        while (of_class.size() > i && std::isnan(last)) last = of_class.pop();
        if (std::isnan(last)) break;
        const int number = of_class.size();
        flip(voxelsOf(number, voxels), number, i);
        of_class.put(i, last);
      }
    }
    num_planes = numPlanesFor(std::max(values[0].size(), values[1].size()));
  }
};

PackedVoxels::PackedVoxels(const PackedVoxels& other)
    : block_(other.isEmpty() ? nullptr : new std::byte[other.numBytes()]) {
  shape_ = other.shape_;
  std::copy(other.block_.get(), other.block_.get() + other.numBytes(), block_.get());
}

PackedVoxels::PackedVoxels(const BrickMask& known, const VoxelValues& values) {
  Unpacked unpacked;
  BrickMask left = known;
  for (int z = 0; z < kBrickEdge; ++z) {
    while (left[z] != 0) {
      const int first = 64 * z + __builtin_ctzll(left[z]);
      const float log_odds = values[static_cast<std::size_t>(first)];
      BrickMask same;
      left.forEach([&](int voxel) {
        if (values[static_cast<std::size_t>(voxel)] == log_odds) same.set(voxel);
      });
      unpacked.set(same, 0, -1, log_odds);
      left &= ~same;
    }
  }
  unpacked.compact();
  pack(unpacked);
}

PackedVoxels::PackedVoxels(const BrickMask& known, float log_odds) {
  Unpacked unpacked;
  if (!known.isEmpty()) unpacked.set(known, 0, -1, log_odds);
  pack(unpacked);
}

BrickMask PackedVoxels::maskOf(int mask) const {
  const std::uint64_t* word = words(mask);
  BrickMask all;
  if (shape_.slices == kAllSlices) {
    std::copy(word, word + kBrickEdge, &all[0]);
    return all;
  }
  for (unsigned left = shape_.slices; left != 0; left &= left - 1) {
    all[__builtin_ctz(left)] = *word++;
  }
  return all;
}

BrickMask PackedVoxels::known() const {
  if (shape_.has_known) return maskOf(0);
  BrickMask slices;
  for (unsigned left = shape_.slices; left != 0; left &= left - 1) {
    slices[__builtin_ctz(left)] = ~std::uint64_t{0};
  }
  return slices;
}

BrickMask PackedVoxels::occupied() const {
  if (!isAnyOccupied()) return BrickMask();
  return shape_.has_occupied ? maskOf(shape_.has_known ? 1 : 0) : known();
}

bool PackedVoxels::isFinite() const {
  const int num_values = shape_.num_free_values + shape_.num_occupied_values;
  return std::all_of(values(), values() + num_values,
                     [](float log_odds) { return std::isfinite(log_odds); });
}

std::optional<float> PackedVoxels::logOddsAt(int voxel) const {
  const Occupancy occupancy = at(voxel);
  if (occupancy == Occupancy::kUnknown) return std::nullopt;
  int number = occupancy == Occupancy::kOccupied ? shape_.num_free_values : 0;
  for (int i = 0; i < shape_.num_planes; ++i) {
    number += static_cast<int>(test(firstPlane() + i, voxel)) << i;
  }
  return values()[number];
}

void PackedVoxels::getValues(VoxelValues& values) const {
  forEachValue([&values](float log_odds, const BrickMask& voxels) {
    voxels.forEach([&](int voxel) { values[static_cast<std::size_t>(voxel)] = log_odds; });
  });
}

VoxelChange PackedVoxels::observe(const BrickMask& hits, const BrickMask& all_misses,
                                  const SensorModel& model, PackedVoxels& result) const {
  const BrickMask misses = all_misses.without(hits);
  Unpacked unpacked(*this);
  struct Observation {
    const BrickMask& voxels;
    float log_odds;
  };
  const std::array<Observation, 2> observations{{{misses, model.miss()}, {hits, model.hit()}}};
  Moves moves;
  VoxelChange change;
  const auto move = [&](const BrickMask& voxels, float to, bool is_from_occupied, int from) {
    moves.push({voxels, to, is_from_occupied, from});
    change.changed |= voxels;
    const bool is_occupied = classify(to) == Occupancy::kOccupied;
    if (from < 0 || is_occupied != is_from_occupied) change.reclassified |= voxels;
  };
  const auto observe = [&](int number, float log_odds, const BrickMask& of_class,
                           bool is_occupied) {
    BrickMask rest;
    bool is_looked_at = false;
    for (const Observation& observation : observations) {
      const float to = model.update(log_odds, observation.log_odds);
      if (to == log_odds) continue;
      const BrickMask seen = of_class & observation.voxels;
      if (seen.isEmpty()) continue;
      const BrickMask voxels = unpacked.voxelsOf(number, seen);
      if (voxels.isEmpty()) continue;
      if (!is_looked_at) rest = unpacked.voxelsOf(number, of_class);
      is_looked_at = true;
      rest &= ~voxels;
      move(voxels, to, is_occupied, number);
    }
    if (is_looked_at && rest.isEmpty()) moves.last().is_last = true;
  };

  for (const Observation& observation : observations) {
    const BrickMask fresh = observation.voxels.without(unpacked.known);
    if (!fresh.isEmpty()) move(fresh, model.update(0.0F, observation.log_odds), false, -1);
  }
  const BrickMask free_voxels = unpacked.known.without(unpacked.occupied);
  for (int i = 0; i < shape_.num_free_values; ++i) observe(i, values()[i], free_voxels, false);
  for (int i = 0; i < shape_.num_occupied_values; ++i) {
    observe(i, values()[shape_.num_free_values + i], unpacked.occupied, true);
  }
  if (moves.isEmpty()) return change;

  unpacked.setValues(*this);
  moves.forEach([&](const Move& m) {
    if (m.is_last) unpacked.values[m.is_from_occupied ? 1 : 0].vacate(m.from);
  });
  moves.forEach([&](const Move& m) {
    const bool stays = m.is_from_occupied == (classify(m.to) == Occupancy::kOccupied);
    unpacked.set(m.voxels, std::max(m.from, 0), stays ? m.from : -1, m.to);
  });
  unpacked.compact();
  result.pack(unpacked);
  return change;
}

VoxelChange PackedVoxels::replace(const BrickMask& part, PackedVoxels other,
                                  PackedVoxels& result) const {
  if (!part.isFull()) {
    Unpacked unpacked(*this);
    unpacked.setValues(*this);
    unpacked.clear(part);
    other.forEachValue([&](float log_odds, const BrickMask& voxels) {
      const BrickMask taken = voxels & part;
      if (!taken.isEmpty()) unpacked.set(taken, 0, -1, log_odds);
    });
    other.pack(unpacked);
  }
  if (*this == other) return {};
  const BrickMask known_here = known();
  const BrickMask known_there = other.known();
  const VoxelChange change{(known_here | known_there) & part,
                           (known_here ^ known_there) | (occupied() ^ other.occupied())};
  result = std::move(other);
  return change;
}

/// Most bricks differ in a log-odds, which shows without a look at the planes.
bool operator==(const PackedVoxels& a, const PackedVoxels& b) {
  const int num_free = a.shape_.num_free_values;
  const int num_occupied = a.shape_.num_occupied_values;
  if (a.shape_.slices != b.shape_.slices || num_free != b.shape_.num_free_values ||
      num_occupied != b.shape_.num_occupied_values ||
      !std::is_permutation(a.values(), a.values() + num_free, b.values()) ||
      !std::is_permutation(a.values() + num_free, a.values() + num_free + num_occupied,
                           b.values() + num_free)) {
    return false;
  }
  const PackedVoxels::Masks here(a);
  const PackedVoxels::Masks there(b);
  if (here.known != there.known || here.occupied != there.occupied) return false;
  const BrickMask free_voxels = here.known.without(here.occupied);
  const auto is_same = [&](int first, int count, const BrickMask& of_class) {
    const float* values = a.values() + first;
    const float* others = b.values() + first;
    for (int i = 0; i < count; ++i) {
      const auto k = static_cast<int>(std::find(others, others + count, values[i]) - others);
      if (here.voxelsOf(i, of_class) != there.voxelsOf(k, of_class)) return false;
    }
    return true;
  };
  return is_same(0, num_free, free_voxels) && is_same(num_free, num_occupied, here.occupied);
}

std::size_t PackedVoxels::numBytes(const Shape& shape) {
  const int num_words = numMasks(shape) * countSlices(shape.slices);
  const std::size_t num_values =
      std::size_t{shape.num_free_values} + std::size_t{shape.num_occupied_values};
  return static_cast<std::size_t>(num_words) * sizeof(std::uint64_t) + num_values * sizeof(float);
}

std::uint64_t PackedVoxels::numEncoded() { return num_encoded; }

void PackedVoxels::pack(const Unpacked& unpacked) {
  ++num_encoded;
  Shape shape;
  for (unsigned z = 0; z < kBrickEdge; ++z) {
    if (unpacked.known[z] == 0) continue;
    shape.slices = static_cast<std::uint8_t>(shape.slices | 1U << z);
    shape.has_known |= unpacked.known[z] != ~std::uint64_t{0};
  }
  if (shape.slices == 0) {
    *this = PackedVoxels();
    return;
  }
  const auto& [free_values, occupied_values] = unpacked.values;
  shape.num_free_values = static_cast<std::uint16_t>(free_values.size());
  shape.num_occupied_values = static_cast<std::uint16_t>(occupied_values.size());
  shape.num_planes = static_cast<std::uint8_t>(unpacked.num_planes);
  shape.has_occupied = free_values.size() > 0 && occupied_values.size() > 0;
  const std::size_t num_bytes = numBytes(shape);
  if (num_bytes != numBytes()) block_.reset(new std::byte[num_bytes]);
  shape_ = shape;
  auto* word = reinterpret_cast<std::uint64_t*>(block_.get());
  const auto put = [&](const BrickMask& mask) {
    for (unsigned left = shape.slices; left != 0; left &= left - 1) {
      *word++ = mask[__builtin_ctz(left)];
    }
  };
  if (shape.has_known) put(unpacked.known);
  if (shape.has_occupied) put(unpacked.occupied);
  for (int i = 0; i < shape.num_planes; ++i) put(unpacked.planes[static_cast<std::size_t>(i)]);
  auto* value = reinterpret_cast<float*>(word);
  value = std::copy(free_values.data(), free_values.data() + free_values.size(), value);
  std::copy(occupied_values.data(), occupied_values.data() + occupied_values.size(), value);
}

PackedVoxels PackedVoxels::ofClasses(const BrickMask& known, const BrickMask& occupied,
                                     const SensorModel& model) {
  Unpacked unpacked;
  for (const bool is_occupied : {false, true}) {
    const BrickMask of_class = is_occupied ? known & occupied : known.without(occupied);
    if (of_class.isEmpty()) continue;
    unpacked.set(of_class, 0, -1, is_occupied ? model.max() : model.min());
  }
  PackedVoxels packed;
  packed.pack(unpacked);
  return packed;
}

}  // namespace cuboid_mapping
