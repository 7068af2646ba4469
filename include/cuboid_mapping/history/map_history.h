// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/history/pose_track.h"
#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/map/map_snapshot.h"
#include "cuboid_mapping/map/progress_listener.h"
#include "cuboid_mapping/scan/brick_update.h"
#include "cuboid_mapping/scan/scan_filter.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

namespace cuboid_mapping {

/// Settings with which the clouds of a sensor enter a map.
struct ObservationConfig {
  SensorModelConfig sensor_model;  ///< Hit and miss of the sensor, thresholds of the map.
  BeamRanges ranges;               ///< Ranges of the beams.
  ScanLimits limits;               ///< Limits of the points that take part.
  bool marks = true;               ///< Whether hits count.
  bool clears = true;              ///< Whether misses count.
};

/// The scans of one observation, which can enter a map with any pose.
struct KeptCloud {
  std::int64_t stamp_ns = 0;  ///< Stamp since 1970.
  /// Current pose of the body in the map.
  Eigen::Isometry3d T_map_body = Eigen::Isometry3d::Identity();
  /// Scans in the frame of the body, with anchors of 0 and rounded, see roundScan(). A sweep measured on the
  /// move has one scan for each slice, relative to the body at the stamp.
  std::vector<Scan> scans_body;
};

/// Limit of a MapHistory. Beyond it, the oldest clouds become fixed.
struct HistoryLimits {
  std::uint64_t max_bytes = std::uint64_t{1} << 30;  ///< Limit of the packed clouds.
};

/// Amounts in a MapHistory.
struct HistoryFigures {
  std::size_t num_clouds = 0;    ///< Kept clouds.
  std::uint64_t num_bytes = 0;   ///< Size of the packed clouds.
  std::uint64_t num_points = 0;  ///< Points of these clouds.
  std::uint64_t num_fixed = 0;   ///< Clouds that became fixed so far, see MapHistory.
};

/// Rule for clouds before the first and after the last new pose.
enum class OutsidePoses : unsigned char {
  kFollow,  ///< They move as the body at the first or the last pose does.
  kStay     ///< They keep their poses.
};

/// Distance from the body at which bounds of motions are compared with the tolerance.
constexpr double kShiftDistance_m = 10.0;

/// Rule by which new poses move clouds and edits.
struct CorrectionRule {
  OutsidePoses outside = OutsidePoses::kFollow;  ///< Rule for clouds outside the new poses.
  /// A cloud keeps its pose if the new one moves no point at kShiftDistance_m from the body by more: >= 0.
  double tolerance_m = 0.0;
  /// Edits and their locks move with the body at the last cloud before them, or else at the first kept cloud:
  /// by the shift of the center of the edit in whole voxels, without a turn. If false, they stay.
  bool edits_move = false;
};

/// A corrected map that is being built. While it lives, its history makes no cloud fixed. When a call with it has
/// thrown, it may only be destroyed; the history is as before.
class MapCorrection {
 public:
  /// Takes over a correction.
  MapCorrection(MapCorrection&&) noexcept;
  ~MapCorrection();

  /// The map with the clouds and edits so far.
  [[nodiscard]] CuboidMap& map();
  /// Number of kept clouds in it.
  [[nodiscard]] std::size_t numClouds() const;
  /// Number of these clouds outside the new poses.
  [[nodiscard]] std::size_t numOutside() const;
  /// Largest motion of the body.
  [[nodiscard]] double maxShift_m() const;

 private:
  friend class MapHistory;
  struct Implementation;  // src/cuboid_mapping/history/map_correction.h
  explicit MapCorrection(std::unique_ptr<Implementation> implementation);
  std::unique_ptr<Implementation> implementation_;
};

/// The clouds and edits of a map in their order, from which the map can be made again with corrected poses: the
/// initial map, packed scans of the clouds, and results of the edits.
///
/// A corrected map equals, voxel by voxel, the map that the same clouds with the new poses, and the same edits,
/// make from scratch in the order of arrival. Clouds are rounded (roundScan()) before they enter the first map,
/// so that it equals a map rebuilt from the kept clouds with the same poses.
///
/// Beyond the limits, the oldest cloud becomes fixed: it enters the initial map, and no correction moves it any
/// more. This takes the time of one more cloud, and the memory of a second map.
///
/// Edits and locks stay where they are in the map, or move along: see CorrectionRule.
///
/// Thread-safe. Functions throw MapFileError if the disk is full, and std::bad_alloc.
class MapHistory {
 public:
  /// @param config  Configuration of the map. @param step_m  See roundScan(): > 0.
  /// @throws std::invalid_argument  for errors in them.
  MapHistory(const MapConfig& config, double step_m, const HistoryLimits& limits);
  ~MapHistory();
  MapHistory(const MapHistory&) = delete;
  MapHistory& operator=(const MapHistory&) = delete;

  /// Step to which scans are rounded.
  [[nodiscard]] double step_m() const;

  /// Forgets everything, and starts from a map. @param map  Has the config; its sensor model may differ.
  void restart(const CuboidMap& map);

  /// Adds a cloud that is in the map. Older clouds may become fixed. Where it throws, the cloud is not added.
  /// @throws std::invalid_argument  with all errors in `config`; or as PoseTrack, for its pose.
  void add(const KeptCloud& cloud, const ObservationConfig& config);

  /// Adds an edit: the current content of the map inside a box, and its locks. @param box  Empty: the locks
  /// alone.
  /// @param whole  Box of the whole edit if this is a part of it, so that all parts move as one; else empty.
  void addEdit(const CellBox& box, const CuboidMap& map, const CellBox& whole = {});

  /// Number of clouds and edits added so far, in all.
  [[nodiscard]] std::uint64_t numAdded() const;

  /// Drops edits that were undone, after which the map is as before them. Does nothing if other edits, clouds
  /// or a restart() came in between, or while a MapCorrection lives.
  /// @param num_before  numAdded() before them. @param count  Number of edits, and of edits that undid them.
  void dropEdits(std::uint64_t num_before, std::uint64_t count);

  /// Current amounts.
  [[nodiscard]] HistoryFigures figures() const;

  /// Upper bound of the motion of a point at this distance from the body, over the clouds within the new poses; nothing
  /// without any. @throws std::invalid_argument  The distance is not >= 0.
  [[nodiscard]] std::optional<double> findShift_m(const PoseTrack& poses, double distance_m) const;

  /// Begins a correction, which catchUp() fills.
  /// @throws std::invalid_argument  when no cloud is kept, none lies within the new poses, or a cloud would lie
  ///         beyond kAllCells.
  [[nodiscard]] MapCorrection begin(const PoseTrack& poses, const CorrectionRule& rule = {});

  /// Rebuilds the map with other poses of the body, on the config's threads: begin() and catchUp(). Clouds and
  /// edits may be added meanwhile.
  /// @param listener  Reports clouds and edits; its exceptions are passed on. @throws As begin().
  [[nodiscard]] MapCorrection correct(const PoseTrack& poses, const CorrectionRule& rule = {},
                                      const ProgressListener& listener = {});

  /// Puts clouds and edits added since the last call into a corrected map, so that finish() has less to do.
  /// @throws std::runtime_error  after a restart(), and as correct(). @return Number of clouds and edits put
  ///         in.
  std::size_t catchUp(MapCorrection& correction, const ProgressListener& listener = {});

  /// As catchUp(); then gives the kept clouds their new poses. Nothing may be added between this call and the
  /// caller's exchange of the maps.
  void finish(MapCorrection& correction);

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace cuboid_mapping
