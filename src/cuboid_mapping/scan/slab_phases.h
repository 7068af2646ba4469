// SPDX-License-Identifier: BSD-3-Clause
// Phases of markSlabs() and markSlabsAvx2().
#pragma once

#include <cstdint>

namespace cuboid_mapping {

/// Phases are fixed-point numbers of borders crossed: 16 bits before the point, 48 after it.
constexpr int kPhaseBits = 48;
constexpr int kMaxSlabs = 30000;  ///< Counts of borders fit into a phase.
/// How near a border rounding may move a phase across it.
constexpr std::int64_t kUnsure = 1LL << (kPhaseBits - 22);
/// Share of a length that rounding errors of sums of up to 2^16 terms do not reach.
constexpr double kUnsureShare = 1.0 / (1ULL << 32);

}  // namespace cuboid_mapping
