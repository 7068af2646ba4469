// SPDX-License-Identifier: BSD-3-Clause
// Phases of markSlabs() and markSlabsAvx2().
#pragma once

#include <cstdint>

namespace cuboid_mapping {

/// Bits after the point in phases, fixed-point numbers of crossed borders, with 16 bits before it.
constexpr int kPhaseBits = 48;
constexpr int kMaxSlabs = 30000;  ///< Maximum number of slabs: counts of borders fit into a phase.
/// Distance to a border within which rounding may move a phase across it.
constexpr std::int64_t kUnsure = 1LL << (kPhaseBits - 22);
/// Bound of rounding errors in sums of up to 2^16 terms, as a share of the length.
constexpr double kUnsureShare = 1.0 / (1ULL << 32);

}  // namespace cuboid_mapping
