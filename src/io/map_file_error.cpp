// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/io/map_file_error.h"

namespace cuboid_mapping {

void throwIfFaulty(const MapSnapshot& snapshot, const SnapshotLimits& limits) {
  const auto fault = findFault(snapshot, limits);
  if (!fault) return;
  throw MapFileError(fault->is_too_big ? MapFileDefect::kTooBig : MapFileDefect::kCorrupted,
                     "cannot be a map: " + fault->text + ". It is damaged, or no map");
}

}  // namespace cuboid_mapping
