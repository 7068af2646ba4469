// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/map_snapshot.h"

namespace cuboid_mapping {

/// Limits for small maps: larger claims would only take the fuzzer's time.
inline SnapshotLimits fuzzLimits() {
  SnapshotLimits limits;
  limits.max_bricks = 4096;
  limits.max_bytes = 1 << 22;
  return limits;
}

}  // namespace cuboid_mapping
