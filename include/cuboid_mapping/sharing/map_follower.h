// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/sharing/map_image.h"

#include <optional>
#include <string>

namespace cuboid_mapping {

/// All bricks of a map, along the Morton curve, each divided into cuboids of one class as
/// divideBrick() does, whatever the fusion of the map. @complexity O(n).
[[nodiscard]] MapImage makeImage(const CuboidMap& map, std::uint64_t instance, MapDetail detail);

/// What is now in the bricks of a change set; with kClasses only in those that have new cuboids.
/// @param base  Revision that the changes are counted from.
/// @complexity O(b) for b bricks.
[[nodiscard]] MapDelta makeDelta(const CuboidMap& map, const ChangeSet& changes,
                                 std::uint64_t instance, std::uint64_t base, MapDetail detail);

/// What became of a delta.
enum class FollowResult : unsigned char {
  kApplied,  ///< The copy is now at the revision of the delta.
  kOld,      ///< The copy has it already: nothing was done.
  kGap,      ///< Changes in between were lost, or the map was replaced: an image is needed.
  kDamaged,  ///< The arrays do not fit together, or the resolution differs: nothing was done.
};

/// A copy of a map, made of an image and kept up with deltas, whatever their order, and however many
/// are lost or come twice. Every voxel has the class that it has in the map, and its log-odds where
/// these travel; else those of the clamping thresholds. Cuboids are those of FusionKind::kClass.
/// Not thread-safe.
class MapFollower {
 public:
  /// Takes an image. One of the same instance that is older than the copy is not taken.
  /// @return false when its arrays do not fit together, or no map can have its resolution; the copy
  ///         is then as it was.
  [[nodiscard]] bool take(const MapImage& image);
  /// Takes changes. @return kApplied, or why the copy is as it was.
  [[nodiscard]] FollowResult take(const MapDelta& delta);

  /// The copy; nothing before the first image. Its revision is its own: see revision().
  [[nodiscard]] const CuboidMap* map() const { return map_ ? &*map_ : nullptr; }
  /// Of the map that is followed; 0 before the first image.
  [[nodiscard]] std::uint64_t revision() const { return revision_; }
  /// Of the server of that map, see MapImage; 0 before the first image.
  [[nodiscard]] std::uint64_t instance() const { return instance_; }

 private:
  std::optional<CuboidMap> map_;
  std::uint64_t instance_ = 0;
  std::uint64_t revision_ = 0;
};

}  // namespace cuboid_mapping
