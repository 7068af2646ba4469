// SPDX-License-Identifier: BSD-3-Clause
// Finished maps: taken to another frame, and put together. The result is not the map that one mapper with all
// clouds would have made, because log-odds are clamped cloud by cloud; observations (doc/fleet.md) give that one.
#pragma once

#include "cuboid_mapping/map/map_snapshot.h"
#include "cuboid_mapping/map/progress_listener.h"

#include <Eigen/Geometry>

#include <optional>
#include <string>

namespace cuboid_mapping {

/// How voxels got into another frame.
struct MapMotion {
  bool is_exact = true;  ///< Each voxel has gone to a voxel of its own.
  double max_offset_m =
      0.0;  ///< Greatest distance of a voxel's centre from that of the voxel whose log-odds it has.
  double mean_offset_m = 0.0;  ///< Mean of these distances.
};

/// Takes a map to another frame.
///
/// Cases:
///   - turns by multiples of 90 degrees about the axes (within 1e-9) with shifts by whole voxels (within 1e-6
///     voxels): exact, the same voxels at other places;
///   - else it is resampled: a voxel gets the log-odds of the voxel that its centre comes from, and stays unknown where
///     that one is. Walls one voxel thick stay closed: no way through them by faces. Poles one voxel thick may get gaps.
/// Locked are all voxels that share space with a locked box that was moved.
/// @param T_target_map  Metres. @param map  Its bricks and locks are replaced, addCuboids() is undone; the rest stays, the name
///                      of the frame too.
/// @param threads  The result does not depend on it. @param listener  Is told of parts of the map.
/// @throws std::invalid_argument  The transform is not finite, or no rotation; or the map would reach beyond kAllCells.
///         Or what the listener throws. Nothing has changed then.
/// @complexity O(n).
MapMotion moveMap(const Eigen::Isometry3d& T_target_map, MapSnapshot& map, int threads = 1,
                  const ProgressListener& listener = {});

/// Log-odds of a voxel that both maps know.
enum class MergeRule : unsigned char {
  kSum,      ///< The sum of log-odds, as if the two had seen it independently of each other.
  kLater,    ///< The log-odds of the second map.
  kOccupied  ///< The greater log-odds: occupied if either says so.
};

/// "sum", "later" or "occupied".
[[nodiscard]] const char* toString(MergeRule rule);
/// The rule of a name; nothing for another text.
[[nodiscard]] std::optional<MergeRule> mergeRuleOfName(const std::string& name);

/// How two maps overlap, in voxels; exact up to 2^53.
struct MapOverlap {
  double known_to_both = 0.0;   ///< Whatever their classes.
  double other_class = 0.0;     ///< Voxels free in one map and occupied in the other.
  double only_in_first = 0.0;   ///< Known to it alone.
  double only_in_second = 0.0;  ///< Known to it alone.
};

/// Puts a second map into a first one. Voxels that one of them knows alone stay as they are; in any case log-odds are clamped to
/// the thresholds of the first, whose sensor model, environment and frame the result has. Voxels are locked that either has
/// locked.
/// @throws std::invalid_argument  The resolutions differ. @pre findFault() finds none in either.
/// @complexity O(n).
MapOverlap mergeMaps(const MapSnapshot& second, MergeRule rule, MapSnapshot& first);

/// "exact: by whole voxels", or how far voxels lie from where they were.
[[nodiscard]] std::string describe(const MapMotion& motion);
/// The figures in a sentence, with the warning that it is not the map of all clouds.
[[nodiscard]] std::string describe(const MapOverlap& overlap, MergeRule rule);

}  // namespace cuboid_mapping
