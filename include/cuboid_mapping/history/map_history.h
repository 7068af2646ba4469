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
#include <vector>

namespace cuboid_mapping {

/// How the clouds of a sensor get into a map.
struct ObservationConfig {
  SensorModelConfig sensor_model;  ///< Thresholds are those of the map.
  BeamRanges ranges;               ///< Ranges of the beams.
  ScanLimits limits;               ///< Which points take part, where the scan lies in the map.
  bool marks = true;               ///< Whether hits count.
  bool clears = true;              ///< Whether misses count.
};

/// The scans of one observation, which can enter a map with any pose.
struct KeptCloud {
  std::int64_t stamp_ns = 0;  ///< Since 1970.
  /// The pose that it has in the map now.
  Eigen::Isometry3d T_map_body = Eigen::Isometry3d::Identity();
  /// In the frame of the body, with anchors of 0 and rounded, see roundScan(). Of a sweep that was measured on the move:
  /// one for each slice, where it was seen from the body's place at the stamp.
  std::vector<Scan> scans_body;
};

/// Content of a MapHistory.
struct HistoryLimits {
  std::uint64_t max_bytes = std::uint64_t{1} << 30;  ///< Limit of the packed clouds.
  double max_age_s = 1e9;  ///< Clouds that are older than the newest by more become fixed.
};

/// How much a MapHistory keeps.
struct HistoryFigures {
  std::size_t num_clouds = 0;    ///< Kept.
  std::uint64_t num_bytes = 0;   ///< Size of the packed clouds.
  std::uint64_t num_points = 0;  ///< Number of points of these clouds.
  std::uint64_t num_fixed = 0;   ///< Clouds so far that are no longer kept, see MapHistory.
};

/// Clouds before the first and after the last of new poses.
enum class OutsidePoses : unsigned char {
  kFollow,  ///< They move as the body at the first or the last pose does.
  kStay     ///< They stay where they are.
};

/// Distance from the body at which a tolerance counts.
constexpr double kShiftDistance_m = 10.0;

/// What new poses move.
struct CorrectionRule {
  OutsidePoses outside = OutsidePoses::kFollow;  ///< Clouds outside the new poses.
  /// A cloud keeps its pose if the new one moves no point at kShiftDistance_m from the body by more: >= 0.
  double tolerance_m = 0.0;
  /// Whether edits and their locks move as the body did at the last cloud before them, or at the first kept cloud where none
  /// is kept before: by as many whole voxels as the center of the edit moves, and without a turn. Else they stay.
  bool edits_move = false;
};

/// A corrected map in the making. As long as it lives, its history makes no cloud fixed.
class MapCorrection {
 public:
  /// Takes over a correction.
  MapCorrection(MapCorrection&&) noexcept;
  ~MapCorrection();

  /// The map with the clouds and edits so far.
  [[nodiscard]] CuboidMap& map();
  /// Clouds in it that are kept.
  [[nodiscard]] std::size_t numClouds() const;
  /// Number of these clouds outside the new poses.
  [[nodiscard]] std::size_t numOutside() const;
  /// Bricks that no moved cloud touches, and which were taken over; 0 where all was made anew.
  [[nodiscard]] std::size_t numStayed() const;
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
/// A corrected map is equal, voxel by voxel, to a map that the same clouds, with the new poses, and the same edits have made
/// from scratch, in the order in which they came. Clouds are rounded before they get into the first map (roundScan()),
/// so that this is the map as well that the sensor's clouds would make, and equal poses make the equal map.
///
/// What the limits do not let it keep becomes fixed: the oldest cloud goes into the map that is begun with, and no
/// correction moves it any more. This takes the time of a cloud once more, and the memory of a second map.
///
/// Edits and locks stay where they are in the map, or move along: see CorrectionRule.
///
/// Thread-safe. Functions throw MapFileError for want of space on the disk, and std::bad_alloc.
class MapHistory {
 public:
  /// @param config  Of the map. @param step_m  See roundScan(): > 0.
  MapHistory(const MapConfig& config, double step_m, const HistoryLimits& limits);
  ~MapHistory();
  MapHistory(const MapHistory&) = delete;
  MapHistory& operator=(const MapHistory&) = delete;

  /// Rounding of scans.
  [[nodiscard]] double step_m() const;

  /// Forgets everything, and begins with a map as it is. @param map  Of the config, or with another sensor model.
  void restart(const CuboidMap& map);

  /// Adds a cloud that has got into the map. It may make older ones fixed.
  void add(const KeptCloud& cloud, const ObservationConfig& config);

  /// Adds an edit: the content of the map inside a box now, and its locks. @param box  Empty: the locks alone.
  /// @param whole  Not empty: box of an edit in parts, which moves as one.
  void addEdit(const CellBox& box, const CuboidMap& map, const CellBox& whole = {});

  /// Content at present.
  [[nodiscard]] HistoryFigures figures() const;

  /// Largest motion by the new poses of a point at this distance from the body, over the clouds within them; 0 without any.
  [[nodiscard]] double findShift_m(const PoseTrack& poses, double distance_m) const;

  /// Begins a correction, which catchUp() fills. @param current  Null, or the map that the clouds and edits so far have made;
  /// nothing changes the map or the history during the call. Where few clouds move, bricks that none of them touches, with old
  /// or new pose, are taken over from it: the result is the same. Not with FusionKind::kGrowth.
  /// @throws std::invalid_argument  when no cloud is kept, or none lies within the new poses.
  [[nodiscard]] MapCorrection begin(const PoseTrack& poses, const CorrectionRule& rule = {},
                                    const CuboidMap* current = nullptr);

  /// Makes the map with other poses of the body, by the threads of the config: begin() and catchUp(). Clouds and edits may be
  /// added meanwhile, except with `current` until begin() returns.
  /// @param listener  Hears of clouds and edits. What it throws is passed on. @throws As begin().
  [[nodiscard]] MapCorrection correct(const PoseTrack& poses, const CorrectionRule& rule = {},
                                      const ProgressListener& listener = {},
                                      const CuboidMap* current = nullptr);

  /// Puts observations added since then into a corrected map, so that finish() has less to do.
  /// @throws std::runtime_error  after a restart(), and as correct(). @return Clouds and edits that it has put in.
  std::size_t catchUp(MapCorrection& correction, const ProgressListener& listener = {});

  /// As catchUp(), and takes the new poses for those of the clouds: to be called where nothing is added before the caller
  /// has exchanged the maps.
  void finish(MapCorrection& correction);

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace cuboid_mapping
