// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/rtree/node.h"

#include <array>

namespace cuboid_mapping {

/// Up to M + 1 branches; needs no memory from the allocator.
class BranchList {
 public:
  /// @pre size() <= kMaxSlots.
  void push(const Branch& branch) { branches_[static_cast<std::size_t>(size_++)] = branch; }
  /// Removes a branch; the last one takes its place.
  Branch take(int i) {
    const Branch taken = (*this)[i];
    branches_[static_cast<std::size_t>(i)] = (*this)[--size_];
    return taken;
  }
  [[nodiscard]] int size() const { return size_; }
  [[nodiscard]] const Branch& operator[](int i) const {
    return branches_[static_cast<std::size_t>(i)];
  }
  [[nodiscard]] const Branch* begin() const { return branches_.data(); }
  [[nodiscard]] const Branch* end() const { return branches_.data() + size_; }

 private:
  std::array<Branch, kMaxSlots + 1> branches_;
  int size_ = 0;
};

/// The two groups into which an overfull node is split.
struct SplitGroups {
  BranchList first;
  BranchList second;
};

/// Guttman's quadratic split: the two branches that would waste most volume together start the
/// groups; then the branch with the clearest preference goes to the group that it expands least.
///
/// @param branches  At least 2 * min_branches.
/// @param min_branches  Minimum number of branches of each group (d of the paper).
/// @complexity O(n^2). Pure. A. Guttman, "R-trees", 1984, Section 3.5.2.
[[nodiscard]] SplitGroups splitQuadratic(const BranchList& branches, int min_branches) noexcept;

}  // namespace cuboid_mapping
