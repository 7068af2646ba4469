// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/brick_mask.h"
#include "cuboid_mapping/scan/beam_marks.h"
#include "cuboid_mapping/scan/ray_walk.h"

namespace cuboid_mapping {

/// Walks through the bricks and marks the misses. Copied by value into the walk.
class BrickCursor {
 public:
  BrickCursor(const Ray& ray, const Cell& base, BeamMarks& beam_marks) : beam_marks_(&beam_marks) {
    const Cell local_end = ray.end - base;
    end_key_ = toBrickKey(local_end);
    end_voxel_ = voxelIndex(local_end);
    for (int axis = 0; axis < 3; ++axis) {
      const int step = ray.step[axis];
      voxel_step_[axis] = step * (1 << (3 * axis));
      axis_mask_[axis] = 7 << (3 * axis);
      last_voxel_[axis] = step > 0 ? axis_mask_[axis] : 0;
      key_step_[axis] = static_cast<BrickKey>(static_cast<std::int64_t>(step))
                        << (kBrickKeyBits * axis);
    }
    const Cell local_start = ray.start - base;
    key_ = toBrickKey(local_start);
    voxel_ = voxelIndex(local_start);
    marks_ = &beam_marks_->findOrAdd(key_);
  }

  void mark() { marks_->misses[0].set(voxel_); }

  void advance(int axis) {
    if ((voxel_ & axis_mask_[axis]) != last_voxel_[axis]) {
      voxel_ += voxel_step_[axis];
    } else {
      voxel_ ^= axis_mask_[axis];
      key_ += key_step_[axis];
      marks_ = &beam_marks_->findOrAdd(key_);
    }
  }

  /// Goes on with other marks, from the current voxel.
  void switchTo(BeamMarks& beam_marks) {
    beam_marks_ = &beam_marks;
    marks_ = &beam_marks.findOrAdd(key_);
  }

  [[nodiscard]] bool isAtEnd() const { return voxel_ == end_voxel_ && key_ == end_key_; }

 private:
  BeamMarks* beam_marks_;
  BrickMarks* marks_;
  BrickKey key_;
  BrickKey end_key_;
  int voxel_;
  int end_voxel_;
  int voxel_step_[3];
  int axis_mask_[3];
  int last_voxel_[3];
  BrickKey key_step_[3];
};

/// A BrickCursor that stops behind some slabs of an axis, or goes on there with other marks.
class SlabCursor {
 public:
  /// @param num_slabs  Slabs from the origin's, included. @param behind  Null: it stops.
  SlabCursor(const Ray& ray, const Cell& base, BeamMarks& marks, int axis, int num_slabs,
             BeamMarks* behind = nullptr)
      : cursor_(ray, base, num_slabs == 0 && behind != nullptr ? *behind : marks),
        behind_(behind),
        axis_(axis),
        slabs_left_(num_slabs) {}

  void mark() { cursor_.mark(); }

  void advance(int axis) {
    cursor_.advance(axis);
    if (axis == axis_ && --slabs_left_ == 0 && behind_ != nullptr) cursor_.switchTo(*behind_);
  }

  [[nodiscard]] bool isAtEnd() const {
    return (behind_ == nullptr && slabs_left_ <= 0) || cursor_.isAtEnd();
  }

 private:
  BrickCursor cursor_;
  BeamMarks* behind_;
  int axis_;
  int slabs_left_;
};

}  // namespace cuboid_mapping
