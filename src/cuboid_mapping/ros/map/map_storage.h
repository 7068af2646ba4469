// SPDX-License-Identifier: BSD-3-Clause
// Saving, loading and moving the map of a running node. Functions that return a StorageAnswer throw nothing.
#pragma once

#include "cuboid_mapping/geometry/voxel_motion.h"
#include "cuboid_mapping/map/map_merge.h"
#include "cuboid_mapping/map/map_snapshot.h"
#include "cuboid_mapping/map/progress_listener.h"
#include "cuboid_mapping/ros/map/guarded_map.h"
#include "cuboid_mapping/ros/parameters/parameters.h"

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {

/// Whether there is a map under this name, and no store (.sqlite) whose first save has not ended.
/// @throws MapFileError  for a store that cannot be opened.
[[nodiscard]] bool hasMap(const std::string& file);

/// An unused name beside that of a file, such as NAME-2.ext.
[[nodiscard]] std::string nameBeside(const std::string& file);

/// Name of the file with the locked boxes, beside that of a map.
[[nodiscard]] std::string locksFile(const std::string& map_file);

/// Locked boxes of a map, in a file beside the map. The file is removed if there are none, or the map is a
/// .cuboids, which keeps them.
/// @throws MapFileError naming the file.
///@{
void saveLocks(const GuardedMap& map, const std::string& map_file);
[[nodiscard]] std::vector<CellBox> readLocks(const std::string& map_file);
/// Locks the boxes of readLocks().
void lockAsSaved(GuardedMap& map, const std::string& map_file);
///@}

/// A listener for the functions below that ends them once a flag is set, as when the node ends. @param is_stopping  Must
/// outlive the listener.
[[nodiscard]] ProgressListener endWhen(const std::atomic<bool>& is_stopping);

/// Result of a save or a load.
struct StorageAnswer {
  std::string error;  ///< Empty: the call succeeded.
  std::string notes;  ///< Notes on the accuracy of a moved or merged map.
  std::size_t num_cuboids = 0;
  std::size_t num_bytes = 0;
  std::uint64_t revision = 0;  ///< Revision of the saved or moved map.
};

/// Saves the current map; the extension of the file chooses the format. The map is locked only while its bricks
/// are copied.
/// @param frame_id  Frame of the map, for the file. @param limits  With more on disk nothing is saved.
/// @param listener  A save that it ends leaves the file as it was. A save of .ot or .bt cannot be ended while it is
///                  written.
[[nodiscard]] StorageAnswer saveMap(GuardedMap& map, const std::string& frame_id,
                                    const std::string& file, const SnapshotLimits& limits = {},
                                    const ProgressListener& listener = {});

/// Reads a map while a snapshot of it is taken, and nobody changes it; its exceptions are passed on.
/// @param window  Null: the whole map is in memory.
using SnapshotLook =
    std::function<void(const CuboidMap& map, const ros::Time& stamp, const MapWindow* window)>;

/// All voxels of a map at the time of the call, in memory and on disk. Others get their turn at the map after
/// each page read from the disk. A page that is loaded, changed and saved meanwhile has its saved content.
/// @throws MapFileError  as MapWindow::addStored(). @throws std::runtime_error  when the whole map is replaced
///         meanwhile.
[[nodiscard]] MapSnapshot takeWholeSnapshot(GuardedMap& map, const std::string& frame_id,
                                            const SnapshotLimits& limits,
                                            const SnapshotLook& look = {},
                                            const ProgressListener& listener = {});

/// Limits for reading a file: the memory of the machine.
[[nodiscard]] SnapshotLimits limitsOfMachine();

/// Placement of a file's map in another one.
struct LoadPlacement {
  std::optional<MergeRule> rule;                ///< Nothing: replaces everything.
  std::optional<Eigen::Isometry3d> T_map_file;  ///< Nothing: both have the same frame.
  /// Frame of the map; without a transform, notes report another one of the file.
  std::string frame_id;
};

/// Replaces the map by that of a file, or merges both; see moveMap() and mergeMaps(). Locks stay.
/// An error changes nothing: an unreadable or bad file, another resolution, a bad transform, a map beyond the
/// limits, lack of memory, an end by the listener. Only if memory runs out during a merge, a part stays merged.
///
/// Replacing: the new map is built beside the old one, which is locked for the exchange only; clouds that
/// arrive until then are lost with the old map. Merging: the map is locked for one part after the other, and no
/// cloud is lost.
[[nodiscard]] StorageAnswer loadMap(GuardedMap& map, const std::string& file,
                                    const SnapshotLimits& limits = {},
                                    const LoadPlacement& placement = {},
                                    const ProgressListener& listener = {});

/// Moves a whole map, with its locks and the pages on disk, to another frame. Cuboids of FusionKind::kGrowth
/// grow anew. The new map is built beside the old one, which is locked for the exchange only.
///
/// Refused without any change: the pages on disk exceed the limits or cannot be read, the map would reach
/// beyond kAllCells, memory does not suffice, another call changed the map meanwhile, or the listener.
[[nodiscard]] StorageAnswer moveWholeMap(GuardedMap& map, const VoxelMotion& motion,
                                         const SnapshotLimits& limits = {},
                                         const ProgressListener& listener = {});

/// Text that a map of one frame is used in another, and what to do; empty if the frames agree, or the file has
/// none.
[[nodiscard]] std::string describeOtherFrame(const std::string& of_file, const std::string& of_map);

/// Text why a transform that is no VoxelMotion is refused, and what to do.
[[nodiscard]] std::string describeRefusal(const Eigen::Isometry3d& T_target_map,
                                          double resolution_m);

/// Source of the map at the start.
struct StartMap {
  std::string file;  ///< Empty: none.
  bool is_autosave = false;
};
/// `autosave_file`, if it exists; else `map_file`. Reads no map. @throws MapFileError  if it is missing.
[[nodiscard]] StartMap findStartMap(const NodeParameters& parameters);
/// The map; nothing if there is none. The resolution of `map_file` becomes that of the parameters, as in
/// octomap_server. Sets `autosave_version`.
/// @throws MapFileError naming the file; for an autosave_file of another resolution, too.
[[nodiscard]] std::optional<MapSnapshot> readStartMap(const StartMap& start,
                                                      NodeParameters& parameters);

/// Text such as "3 parts of the map, of 64 x 64 x 64 voxels", for pages.
[[nodiscard]] std::string describePages(std::size_t num_pages);

/// The window of the parameters, with its store opened or created; null without a window.
/// @throws MapFileError  as openStoreOf(), and std::runtime_error for conflicting parameters.
[[nodiscard]] std::unique_ptr<MapWindow> makeWindow(const NodeParameters& parameters,
                                                    CuboidMap& map);

}  // namespace cuboid_mapping_ros
