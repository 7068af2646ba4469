// SPDX-License-Identifier: BSD-3-Clause
// Vectors of gcc and clang, 32 bytes wide: one register with AVX2, two with NEON.
#pragma once

#include <cmath>
#include <cstdint>

#if defined(__x86_64__)
#include <immintrin.h>
#define CUBOID_MAPPING_HAS_LANES 1
// Functions between these two may use AVX2: headers that are included between them, too.
#if defined(__clang__)
#define CUBOID_MAPPING_BEGIN_LANES \
  _Pragma("clang attribute push(__attribute__((target(\"avx2\"))), apply_to = function)")
#define CUBOID_MAPPING_END_LANES _Pragma("clang attribute pop")
#else
#define CUBOID_MAPPING_BEGIN_LANES _Pragma("GCC push_options") _Pragma("GCC target(\"avx2\")")
#define CUBOID_MAPPING_END_LANES _Pragma("GCC pop_options")
#endif
#elif defined(__aarch64__)
#include "cuboid_mapping/scan/lane_pair.h"

#include <arm_neon.h>
#define CUBOID_MAPPING_HAS_LANES 1
#define CUBOID_MAPPING_BEGIN_LANES
#define CUBOID_MAPPING_END_LANES
#endif

#ifdef CUBOID_MAPPING_HAS_LANES

CUBOID_MAPPING_BEGIN_LANES

namespace cuboid_mapping::lanes {

/// Vectors of four beams.
///@{
using Doubles = double __attribute__((vector_size(32)));
using Longs = std::int64_t __attribute__((vector_size(32)));
using Floats = float __attribute__((vector_size(16)));
using Ints = std::int32_t __attribute__((vector_size(16)));
///@}

/// Vectors of eight slabs, and masks of four.
///@{
#ifdef __x86_64__
using Lanes = std::int32_t __attribute__((vector_size(32)));
using Unsigned = std::uint32_t __attribute__((vector_size(32)));
using Fractions = float __attribute__((vector_size(32)));
using Masks = std::uint64_t __attribute__((vector_size(32)));
#else
using Lanes = LanePair<Ints>;
using Unsigned = LanePair<std::uint32_t __attribute__((vector_size(16)))>;
using Fractions = LanePair<Floats>;
using Masks = LanePair<std::uint64_t __attribute__((vector_size(16)))>;
#endif
///@}

/// Loads from, and stores to, aligned arrays.
///@{
template <typename LanesT, typename NumberT>
LanesT load(const NumberT* from) {
  return *reinterpret_cast<const LanesT*>(from);
}
template <typename LanesT, typename NumberT>
void store(const LanesT& lanes, NumberT* to) {
  *reinterpret_cast<LanesT*>(to) = lanes;
}
///@}

#ifdef __x86_64__

/// Lanes of `a` where the flags are set, and of `b` elsewhere.
template <typename FlagsT, typename LanesT>
LanesT select(const FlagsT& flags, const LanesT& a, const LanesT& b) {
  return flags ? a : b;
}
/// The same bits as another vector.
template <typename ToT, typename LanesT>
ToT as(const LanesT& from) {
  return reinterpret_cast<ToT>(from);
}
/// The same numbers in another vector.
template <typename ToT, typename LanesT>
ToT convert(const LanesT& from) {
  return __builtin_convertvector(from, ToT);
}

// Compilers find no single instruction of AVX2 for these.

/// Bits of the flags: bit i is set if lane i is (a lane has all bits or none).
inline std::uint32_t toBits(const Longs& flags) {
  return static_cast<std::uint32_t>(_mm256_movemask_pd(reinterpret_cast<__m256d>(flags)));
}
/// Whether any bit is set.
inline bool hasAny(const Lanes& flags) {
  const auto bits = reinterpret_cast<__m256i>(flags);
  return _mm256_testz_si256(bits, bits) == 0;
}
/// Bit `place` of each mask, below 2^32; no bit if it is 64 or greater.
inline Masks bitAt(const Masks& place) {
  return reinterpret_cast<Masks>(
      _mm256_sllv_epi64(_mm256_set1_epi64x(1), reinterpret_cast<__m256i>(place)));
}
inline Doubles squareRoots(const Doubles& numbers) {
  return reinterpret_cast<Doubles>(_mm256_sqrt_pd(reinterpret_cast<__m256d>(numbers)));
}
inline Doubles floors(const Doubles& numbers) {
  return reinterpret_cast<Doubles>(_mm256_floor_pd(reinterpret_cast<__m256d>(numbers)));
}

#else

inline std::uint32_t toBits(const Longs& flags) {
  std::uint32_t bits = 0;
  for (int i = 0; i < 4; ++i) bits |= static_cast<std::uint32_t>(flags[i] & 1) << i;
  return bits;
}
inline bool hasAny(const Lanes& flags) {
  const Masks bits = as<Masks>(flags);
  const auto either = bits.low | bits.high;
  return (either[0] | either[1]) != 0;
}
/// As above. The processor looks at the lowest byte of a place only, so that greater ones become 64 first.
inline Masks bitAt(const Masks& place) {
  const auto shift = [](const Masks::Half& places) {
    const uint32x4_t least = vminq_u32(reinterpret_cast<uint32x4_t>(places), vdupq_n_u32(64));
    return reinterpret_cast<Masks::Half>(
        vshlq_u64(vdupq_n_u64(1), reinterpret_cast<int64x2_t>(least)));
  };
  return {shift(place.low), shift(place.high)};
}
inline Doubles squareRoots(const Doubles& numbers) {
  Doubles roots{};
  for (int i = 0; i < 4; ++i) roots[i] = std::sqrt(numbers[i]);
  return roots;
}
inline Doubles floors(const Doubles& numbers) {
  Doubles below{};
  for (int i = 0; i < 4; ++i) below[i] = std::floor(numbers[i]);
  return below;
}

#endif

}  // namespace cuboid_mapping::lanes

CUBOID_MAPPING_END_LANES

#endif
