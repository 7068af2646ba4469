// SPDX-License-Identifier: BSD-3-Clause
// Vectors for functions with AVX2, which compute four beams at once.
#pragma once

#include <cstdint>

// Clang has no instruction switch within a file that its linters understand.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define CUBOID_MAPPING_HAS_AVX2 1
#include <immintrin.h>

#pragma GCC push_options
#pragma GCC target("avx2")

namespace cuboid_mapping::avx2 {

/// Vectors of four beams.
///@{
using Doubles = double __attribute__((vector_size(32)));
using Longs = std::int64_t __attribute__((vector_size(32)));
using Floats = float __attribute__((vector_size(16)));
using Ints = std::int32_t __attribute__((vector_size(16)));
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

/// Bits of the flags: bit i is set if lane i is (a lane has all bits or none).
inline std::uint32_t toBits(const Longs& flags) {
  return static_cast<std::uint32_t>(_mm256_movemask_pd(reinterpret_cast<__m256d>(flags)));
}

}  // namespace cuboid_mapping::avx2

#pragma GCC pop_options
#endif
