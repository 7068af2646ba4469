// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/rtree/quadratic_split.h"

#include <cassert>
#include <cmath>
#include <limits>
#include <utility>

namespace cuboid_mapping {
namespace {

/// PickSeeds: the pair with the largest volume wasted by a common bounding box.
std::pair<int, int> pickSeeds(const BranchList& branches) {
  std::array<double, kMaxSlots + 1> volumes{};
  for (int i = 0; i < branches.size(); ++i) {
    volumes[static_cast<std::size_t>(i)] = branches[i].box.numVoxels();
  }
  std::pair<int, int> seeds{0, 1};
  double most_waste = -std::numeric_limits<double>::infinity();
  for (int i = 0; i + 1 < branches.size(); ++i) {
    for (int j = i + 1; j < branches.size(); ++j) {
      const double waste = unite(branches[i].box, branches[j].box).numVoxels() -
                           volumes[static_cast<std::size_t>(i)] -
                           volumes[static_cast<std::size_t>(j)];
      if (waste > most_waste) {
        most_waste = waste;
        seeds = {i, j};
      }
    }
  }
  return seeds;
}

/// A group that is being filled, and its expansion by each other branch.
class Group {
 public:
  Group(const Branch& seed, BranchList& members) : members_(members), box_(seed.box) {
    members_.push(seed);
  }

  /// Adds a branch.
  void add(const Branch& branch) {
    members_.push(branch);
    box_ = unite(box_, branch.box);
  }
  void computeExpansions(const BranchList& rest) {
    volume_ = box_.numVoxels();
    for (int i = 0; i < rest.size(); ++i) {
      expansions_[static_cast<std::size_t>(i)] = unite(box_, rest[i].box).numVoxels() - volume_;
    }
  }
  /// Forgets branch i of `rest`; the last one takes its place.
  void dropExpansion(int i, int last) {
    expansions_[static_cast<std::size_t>(i)] = expansions_[static_cast<std::size_t>(last)];
  }
  [[nodiscard]] double expansion(int i) const { return expansions_[static_cast<std::size_t>(i)]; }
  [[nodiscard]] double volume() const { return volume_; }
  [[nodiscard]] int size() const { return members_.size(); }

 private:
  BranchList& members_;
  CellBox box_;
  double volume_ = 0.0;
  std::array<double, kMaxSlots + 1> expansions_{};
};

/// PickNext: the branch with the greatest difference between the expansions of the two groups.
int pickNext(int count, const Group& first, const Group& second) {
  int next = 0;
  double greatest = -1.0;
  for (int i = 0; i < count; ++i) {
    const double preference = std::abs(first.expansion(i) - second.expansion(i));
    if (preference > greatest) {
      greatest = preference;
      next = i;
    }
  }
  return next;
}

/// Whether the first group expands least; ties go to the smaller volume, then to the group with fewer branches.
bool belongsToFirst(int i, const Group& first, const Group& second) {
  if (first.expansion(i) != second.expansion(i)) return first.expansion(i) < second.expansion(i);
  if (first.volume() != second.volume()) return first.volume() < second.volume();
  return first.size() <= second.size();
}

}  // namespace

SplitGroups splitQuadratic(const BranchList& branches, int min_branches) noexcept {
  assert(branches.size() >= 2 * min_branches && branches.size() >= 2);
  SplitGroups groups;
  BranchList rest = branches;
  const auto [first_seed, second_seed] = pickSeeds(branches);
  Group second(rest.take(second_seed), groups.second);  // The later one first: the other stays.
  Group first(rest.take(first_seed), groups.first);
  first.computeExpansions(rest);
  second.computeExpansions(rest);
  while (rest.size() > 0) {
    int next = rest.size() - 1;
    bool to_first = first.size() + rest.size() <= min_branches;
    if (!to_first && second.size() + rest.size() > min_branches) {
      next = pickNext(rest.size(), first, second);
      to_first = belongsToFirst(next, first, second);
    }
    Group& group = to_first ? first : second;
    (to_first ? second : first).dropExpansion(next, rest.size() - 1);
    group.add(rest.take(next));
    group.computeExpansions(rest);
  }
  return groups;
}

}  // namespace cuboid_mapping
