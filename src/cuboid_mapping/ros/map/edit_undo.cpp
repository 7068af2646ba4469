// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/map/edit_undo.h"

#include <numeric>
#include <utility>

namespace cuboid_mapping_ros {

void EditUndo::keep(const CuboidMap& map, const CellBox& box) {
  if (state_ == State::kClosed) return;
  Part part{box, {}};
  std::size_t num_bytes = 0;
  map.voxels().forEachIn(box, [&](const VoxelBrick& brick) {
    num_bytes += sizeof brick + brick.voxels.numBytes();
    if (num_bytes <= max_bytes_) part.bricks.push_back(brick);
  });
  if (state_ == State::kBegun) {
    edits_.push_back({map.lockedBoxes(), {}, mark_});
    state_ = State::kOpen;
    num_bytes += edits_.back().locked.size() * sizeof(CellBox);
  }
  edits_.back().parts.push_back(std::move(part));
  edits_.back().num_bytes += num_bytes;
  const auto add = [](std::size_t sum, const Edit& edit) { return sum + edit.num_bytes; };
  std::size_t num_all = std::accumulate(edits_.begin(), edits_.end(), std::size_t{0}, add);
  while (edits_.size() > kMaxEdits || (num_all > max_bytes_ && edits_.size() > 1)) {
    num_all -= edits_.front().num_bytes;
    edits_.pop_front();
  }
  if (num_all > max_bytes_) clear();
}

void EditUndo::clear() {
  edits_.clear();
  state_ = State::kClosed;
}

CellBox EditUndo::nextBox() const {
  return edits_.empty() || edits_.back().parts.empty() ? CellBox{} : edits_.back().parts.back().box;
}

std::pair<std::uint64_t, std::size_t> EditUndo::lastEdit() const {
  if (edits_.empty()) return {};
  return {edits_.back().mark, edits_.back().parts.size()};
}

ChangeSet EditUndo::undoPart(CuboidMap& map) {
  ChangeSet changes{map.revision(), false, {}};
  if (edits_.empty()) return changes;
  Edit& edit = edits_.back();
  if (edit.parts.size() <= 1) map.setLocked(edit.locked);  // Replaced voxels may be locked.
  if (!edit.parts.empty()) {
    changes = map.replace(edit.parts.back().box, edit.parts.back().bricks);
    edit.parts.pop_back();
  }
  if (edit.parts.empty()) edits_.pop_back();
  return changes;
}

}  // namespace cuboid_mapping_ros
