// SPDX-License-Identifier: BSD-3-Clause
// Moves finished maps to another frame, and merges them. The result is not the map that one mapper with all
// clouds would have made, because log-odds are clamped cloud by cloud; observations (doc/fleet.md) give that
// one.
#pragma once

#include "cuboid_mapping/geometry/isometry.h"

#include "cuboid_mapping/map/map_snapshot.h"
#include "cuboid_mapping/map/progress_listener.h"

#include <optional>
#include <string>

namespace cuboid_mapping {

/// Moves a map to another frame.
///
/// Cases:
///   - turns by multiples of 90 degrees about the axes (within 1e-9) with shifts by whole voxels (within 1e-6
///     voxels): exact, the same voxels at other places;
///   - else it is resampled: a voxel takes the state of the voxel in which its centre lay before, half a space
///     diagonal away at most. A wall one voxel thick stays closed: no path through it crosses faces only. A pole one voxel thick may get gaps.
/// The voxels of the box around each moved locked box are locked: more than it, if it is turned by other angles.
/// @param T_target_map  Metres.
/// @param map  Gets new bricks and locks, loses its cuboids, and is of FusionKind::kClass. All else stays, also the
///             name of the frame.
/// @param threads  The result does not depend on it. @param listener  Reports parts of the map.
/// @return Whether it was exact.
/// @throws std::invalid_argument  The transform is not finite, or no rotation; or the map would reach beyond
///         kAllCells. Exceptions of the listener are passed on. The map has not changed then.
/// @complexity O(n).
bool moveMap(const Eigen::Isometry3d& T_target_map, MapSnapshot& map, int threads = 1,
             const ProgressListener& listener = {});

/// Rule for the log-odds of a voxel that both maps know.
enum class MergeRule : unsigned char {
  kSum,      ///< The sum of log-odds, as if both maps had observed it independently.
  kLater,    ///< The log-odds of the second map.
  kOccupied  ///< The greater log-odds: occupied if either says so.
};

/// Name of a rule: "sum", "later" or "occupied".
[[nodiscard]] const char* toString(MergeRule rule);
/// The rule of a name; nothing for another text.
[[nodiscard]] std::optional<MergeRule> mergeRuleOfName(const std::string& name);

/// Overlap of two maps, in voxels; exact up to 2^53.
struct MapOverlap {
  double known_to_both = 0.0;   ///< Voxels known to both maps.
  double other_class = 0.0;     ///< Voxels free in one map and occupied in the other.
  double only_in_first = 0.0;   ///< Voxels known to the first map only.
  double only_in_second = 0.0;  ///< Voxels known to the second map only.
};

/// Merges a source, the second map, into a target, the first one. A voxel known to one map keeps its log-odds; all
/// log-odds are clamped to the thresholds of the target, which keeps its sensor model, environment and frame,
/// and loses its cuboids (FusionKind::kClass). A voxel is locked if either map has locked it.
/// @throws std::invalid_argument  The resolutions differ. @pre findFault() finds none in either.
/// @complexity O(n).
MapOverlap mergeMaps(MapSnapshot& target, const MapSnapshot& source, MergeRule rule);

/// The result of moveMap() as a clause.
[[nodiscard]] std::string describeMotion(bool is_exact);
/// The figures as a sentence, with the warning that the result is not the map of all clouds.
[[nodiscard]] std::string describe(const MapOverlap& overlap, MergeRule rule);

}  // namespace cuboid_mapping
