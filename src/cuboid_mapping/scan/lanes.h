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

/// Masks of four slabs.
using Masks = std::uint64_t __attribute__((vector_size(32)));

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

// Compilers find no single instruction of AVX2 for these.

/// Bits of the flags: bit i is set if lane i is (a lane has all bits or none).
inline std::uint32_t toBits(const Longs& flags) {
#ifdef __x86_64__
  return static_cast<std::uint32_t>(_mm256_movemask_pd(reinterpret_cast<__m256d>(flags)));
#else
  std::uint32_t bits = 0;
  for (int i = 0; i < 4; ++i) bits |= static_cast<std::uint32_t>(flags[i] & 1) << i;
  return bits;
#endif
}

/// Whether any bit is set.
inline bool hasAny(const Longs& flags) {
#ifdef __x86_64__
  const auto bits = reinterpret_cast<__m256i>(flags);
  return _mm256_testz_si256(bits, bits) == 0;
#else
  return (flags[0] | flags[1] | flags[2] | flags[3]) != 0;
#endif
}

/// Bit `place` of each mask; no bit if it is 64 or greater.
inline Masks bitAt(const Masks& place) {
#ifdef __x86_64__
  return reinterpret_cast<Masks>(
      _mm256_sllv_epi64(_mm256_set1_epi64x(1), reinterpret_cast<__m256i>(place)));
#else
  return (Masks{} + 1) << (place & 63) & reinterpret_cast<Masks>(place < 64);
#endif
}

inline Doubles squareRoots(const Doubles& numbers) {
#ifdef __x86_64__
  return reinterpret_cast<Doubles>(_mm256_sqrt_pd(reinterpret_cast<__m256d>(numbers)));
#else
  Doubles roots{};
  for (int i = 0; i < 4; ++i) roots[i] = std::sqrt(numbers[i]);
  return roots;
#endif
}

inline Doubles floors(const Doubles& numbers) {
#ifdef __x86_64__
  return reinterpret_cast<Doubles>(_mm256_floor_pd(reinterpret_cast<__m256d>(numbers)));
#else
  Doubles below{};
  for (int i = 0; i < 4; ++i) below[i] = std::floor(numbers[i]);
  return below;
#endif
}

}  // namespace cuboid_mapping::lanes

CUBOID_MAPPING_END_LANES

#endif
