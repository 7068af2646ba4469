// SPDX-License-Identifier: BSD-3-Clause
// Saving, loading and moving the map of a running node. Functions that throw nothing.
#pragma once

#include "cuboid_mapping/geometry/voxel_motion.h"
#include "cuboid_mapping/map/map_merge.h"
#include "cuboid_mapping/map/map_snapshot.h"
#include "cuboid_mapping/ros/map/call_progress.h"
#include "cuboid_mapping/ros/map/guarded_map.h"
#include "cuboid_mapping/ros/parameters/parameters.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {

/// Whether something is there under this name: not a store (.sqlite) whose first save has not ended.
/// @throws cuboid_mapping::MapFileError  for a store that cannot be opened.
[[nodiscard]] bool hasMap(const std::string& file);

/// The file that a path leads to: what a symbolic link names, also where nothing is there.
[[nodiscard]] std::string followLinks(const std::string& file);

/// A name beside that of a file, as NAME-2.ext, under which there is nothing yet.
[[nodiscard]] std::string nameBeside(const std::string& file);

/// The file beside that of a map that has its locked boxes.
[[nodiscard]] std::string locksFile(const std::string& map_file);

/// Locked boxes of a map, in a file beside that of the map. Without any the file goes, and beside a .cuboids, which has
/// them.
/// @throws cuboid_mapping::MapFileError naming the file.
///@{
void saveLocks(const GuardedMap& map, const std::string& map_file);
[[nodiscard]] std::vector<cuboid_mapping::CellBox> readLocks(const std::string& map_file);
///@}

/// Result of a save or a load.
struct StorageAnswer {
  std::string error;  ///< Empty: it is done.
  std::string notes;  ///< Of a map that was moved or put into another one: how exactly.
  std::size_t num_cuboids = 0;
  std::size_t num_bytes = 0;
  std::uint64_t revision = 0;  ///< Revision of the saved map.
};

/// Saves the map as the last cloud has left it; the ending of the file chooses the format. The map
/// is held while its bricks are copied only.
/// @param frame_id  Of the map, for the file. @param limits  With more on disk nothing is saved.
/// @param progress  A cancelled save leaves the file as it was; of .ot and .bt, until it is written.
[[nodiscard]] StorageAnswer saveMap(GuardedMap& map, const std::string& frame_id,
                                    const std::string& file,
                                    const cuboid_mapping::SnapshotLimits& limits = {},
                                    const CallProgress& progress = {});

/// Looks at a map of which a snapshot is taken, while nobody changes it; what it throws is passed on.
/// @param window  Null: all of the map is in memory.
using SnapshotLook =
    std::function<void(const cuboid_mapping::CuboidMap& map, const ros::Time& stamp,
                       const cuboid_mapping::MapWindow* window)>;

/// All voxels of a map, in memory and on disk, as they are at the beginning. Others get their turn at the map after each
/// page that is read from the disk. A part that is brought back, changed and saved meanwhile is as it was saved.
/// @throws cuboid_mapping::MapFileError  as MapWindow::addStored(). @throws std::runtime_error  when the whole map is replaced meanwhile.
/// @throws Cancelled
[[nodiscard]] cuboid_mapping::MapSnapshot takeWholeSnapshot(
    GuardedMap& map, const std::string& frame_id, const cuboid_mapping::SnapshotLimits& limits,
    const SnapshotLook& look, const CallProgress& progress = {});

/// How much reading a file may take: parameter file_memory.
[[nodiscard]] cuboid_mapping::SnapshotLimits makeSnapshotLimits(const NodeParameters& parameters);

/// How the map of a file gets into another one.
struct LoadPlacement {
  std::optional<cuboid_mapping::MergeRule> rule;  ///< Nothing: in the place of all that is there.
  std::optional<Eigen::Isometry3d> T_map_file;    ///< Nothing: both have one frame.
  std::string
      frame_id;  ///< Of the map; without a transform, the answer's notes say that the file has another.
};

/// Puts a map from a file in the place of everything in the map, or into it; see moveMap() and mergeMaps(). Locks stay.
/// After any error all is as it was: an unreadable or bad file, another resolution, a bad transform, too much for the
/// limits, no memory, cancelled.
///
/// In the place of everything: the new map is built beside the old one, which is held for the exchange only: clouds
/// that come in until then are lost with it. Into it: the map is held while the two are put together, and no cloud is
/// lost.
[[nodiscard]] StorageAnswer loadMap(GuardedMap& map, const std::string& file,
                                    const cuboid_mapping::SnapshotLimits& limits = {},
                                    const LoadPlacement& placement = {},
                                    const CallProgress& progress = {});

/// Takes a whole map, with its locks and what its window has on disk, to another frame. Cuboids of FusionKind::kGrowth
/// grow anew. The new map is built beside the old one, which is held for the exchange only.
///
/// Refused, and all is as it was: what is on disk is more than the limits or cannot be read, the map would reach beyond
/// kAllCells, there is no memory, the map was changed meanwhile, or cancelled.
[[nodiscard]] StorageAnswer moveWholeMap(GuardedMap& map, const cuboid_mapping::VoxelMotion& motion,
                                         const cuboid_mapping::SnapshotLimits& limits = {},
                                         const CallProgress& progress = {});

/// Says that a map of one frame is taken as one of another, and what to do; empty where the frames agree, or the file has
/// none.
[[nodiscard]] std::string describeOtherFrame(const std::string& of_file, const std::string& of_map);

/// Why a transform that is no VoxelMotion cannot be taken, and what to do.
[[nodiscard]] std::string describeRefusal(const Eigen::Isometry3d& T_target_map,
                                          double resolution_m);

/// The map of `map_file`, whose resolution becomes that of the parameters, as with octomap_server; without one and with
/// `resume` that of `autosave_file`, where it is there. Nothing when there is none. Sets `is_autosave_read`, and takes a
/// `map_file` away that may be missing, and is.
/// @throws cuboid_mapping::MapFileError naming the file; for an autosave_file of another resolution, too.
[[nodiscard]] std::optional<cuboid_mapping::MapSnapshot> readStartMap(NodeParameters& parameters);

}  // namespace cuboid_mapping_ros
