// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/io/map_file_error.h"

#include "cuboid_mapping/voxels/uniform_boxes.h"

#include <algorithm>
#include <cmath>
#include <sstream>

namespace cuboid_mapping {
namespace {

template <typename... PartsT>
[[noreturn]] void fail(MapFileDefect defect, const PartsT&... parts) {
  std::ostringstream text;
  text << "is not a valid map: ";
  (text << ... << parts);
  text << ". It is damaged, or not a map file";
  throw MapFileError(defect, text.str());
}

}  // namespace

void throwIfFaulty(const MapSnapshot& snapshot, const SnapshotLimits& limits) {
  const auto fault = findFault(snapshot, limits);
  if (!fault) return;
  fail(fault->is_too_big ? MapFileDefect::kTooBig : MapFileDefect::kCorrupted, fault->text);
}

std::vector<VoxelBrick> bricksOf(const std::vector<UniformBox>& boxes,
                                 const SnapshotLimits& limits) {
  double num_bricks = 0.0;
  for (const auto& [box, log_odds] : boxes) {
    if (box.isEmpty() || !kAllCells.contains(box)) {
      fail(MapFileDefect::kCorrupted, "box ", box,
           " is empty, or reaches beyond the limits of a map");
    }
    if (!std::isfinite(log_odds)) {
      fail(MapFileDefect::kCorrupted, "box ", box, " has log-odds ", log_odds);
    }
    num_bricks += numBricks(box) - 1.0;  // Small boxes share bricks, which are counted below.
  }
  // Without a limit, too, a few damaged boxes must not stand for all memory.
  const std::size_t plausible = std::max(SnapshotLimits().max_bricks, 8 * boxes.size());
  const auto limit = static_cast<double>(std::min(limits.max_bricks, plausible));
  if (num_bricks <= limit) {
    BricksOfBoxes result = toBricks(boxes);
    if (result.overlapping) {
      fail(MapFileDefect::kCorrupted, "box ", *result.overlapping, " overlaps another one");
    }
    num_bricks = static_cast<double>(result.bricks.size());
    if (num_bricks <= limit) return std::move(result.bricks);
  }
  fail(MapFileDefect::kTooBig, "it fills ", num_bricks, " bricks of 8 x 8 x 8 voxels, more than ",
       static_cast<std::uint64_t>(limit));
}

}  // namespace cuboid_mapping
