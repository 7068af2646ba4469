// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/ros/middleware/core_names.h"

#include <cstddef>
#include <cstdint>
#include <deque>
#include <utility>
#include <vector>

namespace cuboid_mapping_ros {

/// The voxels and locks that the last edits of a map replaced. Not thread-safe.
///
/// Beyond kMaxEdits or `max_bytes` the oldest edits are dropped. An edit beyond `max_bytes` drops all: the
/// earlier ones cannot be undone exactly without it.
class EditUndo {
 public:
  static constexpr std::size_t kMaxEdits = 20;

  explicit EditUndo(std::size_t max_bytes = std::size_t{64} << 20) : max_bytes_(max_bytes) {}

  /// Begins an edit. @param mark  Kept with it, see lastEdit().
  void begin(std::uint64_t mark = 0) {
    state_ = State::kBegun;
    mark_ = mark;
  }
  /// Keeps the voxels of a box, and the locks, before the edit changes them. Does nothing after clear(), until
  /// begin().
  /// @throws std::bad_alloc
  void keep(const CuboidMap& map, const CellBox& box);
  /// Drops all edits, for example when the whole map is replaced.
  void clear();

  /// Number of edits that can be undone.
  [[nodiscard]] std::size_t size() const { return edits_.size(); }
  /// Box that undoPart() changes; empty when it changes no voxel.
  [[nodiscard]] CellBox nextBox() const;
  /// Mark of the last edit, and the number of its parts; 0 if there is none.
  [[nodiscard]] std::pair<std::uint64_t, std::size_t> lastEdit() const;
  /// Undoes the newest part of the last edit. After its last part, size() is one less. Does nothing if size()
  /// is 0.
  /// @throws std::bad_alloc  The next call undoes the same part.
  ChangeSet undoPart(CuboidMap& map);

 private:
  enum class State { kClosed, kBegun, kOpen };
  struct Part {
    CellBox box;
    std::vector<VoxelBrick> bricks;
  };
  struct Edit {
    std::vector<CellBox> locked;
    std::vector<Part> parts;
    std::uint64_t mark = 0;
    std::size_t num_bytes = 0;
  };

  std::size_t max_bytes_;
  State state_ = State::kClosed;
  std::uint64_t mark_ = 0;  ///< Of the edit that has begun.
  std::deque<Edit> edits_;
};

}  // namespace cuboid_mapping_ros
