// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace cuboid_mapping {

/// Content of the voxels in a message: classes alone, or log-odds. With classes, voxels get the log-odds of the
/// clamping thresholds of a default sensor model.
enum class MapDetail : unsigned char { kClasses, kValues };

/// What the server says of a revision beside its voxels.
struct MapLabel {
  std::string frame_id;            ///< Frame of the map.
  std::int64_t stamp_ns = 0;       ///< Stamp of the last cloud in it.
  std::uint64_t num_replaced = 0;  ///< Times that a reset, load, move or correction replaced it.
};

/// A whole map, for other processes; msg/FullCuboidMap.msg documents each field.
struct MapImage {
  std::uint64_t instance = 0;              ///< Names the server; changes when it is restarted.
  std::uint64_t revision = 0;              ///< Revision of the map.
  double resolution_m = 0.0;               ///< Edge of a voxel.
  MapDetail detail = MapDetail::kClasses;  ///< Content of its voxels.
  std::vector<VoxelBrick> bricks;          ///< All bricks with a known voxel.
  MapLabel label = {};                     ///< Frame, stamp, replacements.
};

/// Changes of a map; msg/CuboidMapUpdate.msg documents each field.
struct MapDelta {
  std::uint64_t instance = 0;  ///< As in MapImage.
  std::uint64_t base = 0;      ///< Revision of the map before the changes.
  std::uint64_t revision = 0;  ///< Revision of the map after the changes.
  bool is_everything = false;  ///< The whole map was replaced; there are no bricks then.
  double resolution_m = 0.0;   ///< Edge of a voxel.
  MapDetail detail = MapDetail::kClasses;  ///< Content of the voxels.
  /// New content of the changed bricks; a brick without known voxels became unknown.
  std::vector<VoxelBrick> bricks;
  MapLabel label = {};  ///< As in MapImage.
};

/// All bricks of a map, along the Morton curve. @complexity O(n).
[[nodiscard]] MapImage makeImage(const CuboidMap& map, std::uint64_t instance, MapDetail detail);

/// Current content of the bricks of a change set; with kClasses only of bricks with new cuboids.
/// @param base  Revision of the map before the changes. @return Without bricks if everything has changed.
/// @complexity O(b) for b bricks.
[[nodiscard]] MapDelta makeDelta(const CuboidMap& map, const ChangeSet& changes,
                                 std::uint64_t instance, std::uint64_t base, MapDetail detail);

/// Result of applying a delta.
enum class FollowResult : unsigned char {
  kApplied,  ///< The copy is now at the revision of the delta.
  kOld,      ///< The copy has it already: nothing was done.
  kGap,      ///< Changes in between were lost, or the map was replaced: an image is needed.
  kDamaged,  ///< Invalid bricks or another resolution: nothing was done.
};

/// A copy of a map, made from an image and updated by deltas, which may come in any order, twice, or never.
/// Every voxel has the class that it has in the map, and its log-odds, see MapDetail. The cuboids are those of
/// FusionKind::kClass. Not thread-safe.
class MapFollower {
 public:
  /// Takes an image; ignores one that is older than the copy, of the same instance.
  /// @return false for invalid bricks, or a resolution that no map can have; the copy is then as before.
  [[nodiscard]] bool take(MapImage image);
  /// Takes changes. @return kApplied; else the reason why the copy is as before. @complexity O(bricks log n).
  [[nodiscard]] FollowResult take(MapDelta delta);
  /// The result of take(), which is not done. @complexity O(bricks).
  [[nodiscard]] FollowResult check(const MapDelta& delta) const;

  /// The copy; nothing before the first image. Its revision is its own: see revision(). An image of another resolution
  /// makes another map.
  [[nodiscard]] const CuboidMap* map() const { return map_ ? &*map_ : nullptr; }
  /// Revision of the followed map; 0 before the first image.
  [[nodiscard]] std::uint64_t revision() const { return revision_; }
  /// Server of the followed map, see MapImage; 0 before the first image.
  [[nodiscard]] std::uint64_t instance() const { return instance_; }
  /// Frame, stamp and replacements of the followed map.
  [[nodiscard]] const MapLabel& label() const { return label_; }

  /// Another copy. @complexity O(n).
  [[nodiscard]] MapFollower copy() const;

 private:
  std::optional<CuboidMap> map_;
  std::uint64_t instance_ = 0;
  std::uint64_t revision_ = 0;
  MapLabel label_;
};

}  // namespace cuboid_mapping
