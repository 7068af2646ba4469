// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/rtree/pack.h"

#include <algorithm>
#include <cassert>
#include <limits>

namespace cuboid_mapping {
namespace {

/// More groups than that are divided into halves, without a search for the best cut.
constexpr std::size_t kCoarseGroups = 4;

/// Packs parts of the branches in place.
class Packer {
 public:
  Packer(std::vector<Branch>& branches, const PackShape& shape)
      : branches_(branches), shape_(shape), rear_(branches.size()) {}

  std::vector<std::size_t> pack() {
    divide(0, branches_.size(), shape_.num_groups);
    return std::move(ends_);
  }

 private:
  void divide(std::size_t first, std::size_t last, std::size_t num_groups) {
    if (num_groups == 1) {
      ends_.push_back(last);
      return;
    }
    const std::size_t groups_before = num_groups / 2;
    const std::size_t groups_after = num_groups - groups_before;
    const std::size_t count = last - first;
    // Both sides must have enough branches for their groups, and not too many.
    const std::size_t least = std::max(groups_before * shape_.fewest,
                                       count - std::min(count, groups_after * shape_.most));
    const std::size_t greatest =
        std::min(groups_before * shape_.most, count - groups_after * shape_.fewest);
    const std::size_t even = std::clamp(count * groups_before / num_groups, least, greatest);
    const bool is_coarse = num_groups > kCoarseGroups;
    orderAlongLongestAxis(first, last, is_coarse ? first + even : last);
    const std::size_t cut =
        first + (is_coarse ? even : findCut(first, last, least, greatest, even));
    divide(first, cut, groups_before);
    divide(cut, last, groups_after);
  }

  /// Sorts all, or, with `middle` < last, only divides into those before and those behind it.
  void orderAlongLongestAxis(std::size_t first, std::size_t last, std::size_t middle) {
    CellBox bounds = branches_[first].box;
    for (std::size_t i = first + 1; i < last; ++i) bounds = unite(bounds, branches_[i].box);
    int axis = 0;
    for (int other = 1; other < 3; ++other) {
      if (length(bounds, other) > length(bounds, axis)) axis = other;
    }
    const auto at = [this](std::size_t i) {
      return branches_.begin() + static_cast<std::ptrdiff_t>(i);
    };
    const auto is_before = [axis](const Branch& a, const Branch& b) {
      return std::int64_t{a.box.min[axis]} + a.box.max[axis] <
             std::int64_t{b.box.min[axis]} + b.box.max[axis];
    };
    if (middle < last) {
      std::nth_element(at(first), at(middle), at(last), is_before);
    } else {
      std::sort(at(first), at(last), is_before);
    }
  }

  static std::int64_t length(const CellBox& box, int axis) {
    return std::int64_t{box.max[axis]} - box.min[axis];
  }

  /// Number of branches before the cut: where both sides share least; ties go to the most even.
  std::size_t findCut(std::size_t first, std::size_t last, std::size_t least, std::size_t greatest,
                      std::size_t even) {
    CellBox box = branches_[last - 1].box;
    for (std::size_t i = last; i-- > first;) rear_[i] = box = unite(box, branches_[i].box);
    box = branches_[first].box;
    std::size_t best = even;
    double least_shared = std::numeric_limits<double>::infinity();
    for (std::size_t n = 1; n <= greatest; ++n) {
      box = unite(box, branches_[first + n - 1].box);
      if (n < least) continue;
      const double shared = intersect(box, rear_[first + n]).numVoxels();
      const auto unevenness = [even](std::size_t m) { return m < even ? even - m : m - even; };
      if (shared < least_shared || (shared == least_shared && unevenness(n) < unevenness(best))) {
        least_shared = shared;
        best = n;
      }
    }
    return best;
  }

  std::vector<Branch>& branches_;
  PackShape shape_;
  std::vector<CellBox> rear_;  ///< Bounding box of a branch and those behind it.
  std::vector<std::size_t> ends_;
};

}  // namespace

std::vector<std::size_t> packBranches(std::vector<Branch>& branches, const PackShape& shape) {
  assert(shape.num_groups >= 1);
  assert(shape.num_groups * shape.fewest <= branches.size());
  assert(branches.size() <= shape.num_groups * shape.most);
  return Packer(branches, shape).pack();
}

}  // namespace cuboid_mapping
