// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/rtree/quadratic_split.h"

#include <cassert>
#include <cmath>
#include <limits>
#include <utility>

namespace cuboid_mapping {
namespace {

/// PickSeeds: the pair with the largest volume wasted by a common bounding box.
std::pair<std::size_t, std::size_t> pickSeeds(const std::vector<Branch>& branches) {
  std::pair<std::size_t, std::size_t> seeds{0, 1};
  double most_waste = -std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i + 1 < branches.size(); ++i) {
    const double volume = branches[i].box.numVoxels();
    for (std::size_t j = i + 1; j < branches.size(); ++j) {
      const double waste = unite(branches[i].box, branches[j].box).numVoxels() - volume -
                           branches[j].box.numVoxels();
      if (waste > most_waste) {
        most_waste = waste;
        seeds = {i, j};
      }
    }
  }
  return seeds;
}

/// A group while branches are given to it.
struct Group {
  explicit Group(const Branch& seed) : branches{seed}, box(seed.box), volume(box.numVoxels()) {}

  [[nodiscard]] double expansion(const CellBox& other) const {
    return unite(box, other).numVoxels() - volume;
  }
  void add(const Branch& branch) {
    branches.push_back(branch);
    box = unite(box, branch.box);
    volume = box.numVoxels();
  }

  std::vector<Branch> branches;
  CellBox box;
  double volume;
};

/// PickNext: the branch with the greatest difference between the expansions of the two groups.
std::size_t pickNext(const std::vector<Branch>& rest, const Group& first, const Group& second) {
  std::size_t next = 0;
  double greatest = -1.0;
  for (std::size_t i = 0; i < rest.size(); ++i) {
    const double preference =
        std::abs(first.expansion(rest[i].box) - second.expansion(rest[i].box));
    if (preference > greatest) {
      greatest = preference;
      next = i;
    }
  }
  return next;
}

/// Least expansion; ties go to the smaller volume, then to the group with fewer branches.
bool belongsToFirst(const CellBox& box, const Group& first, const Group& second) {
  const double into_first = first.expansion(box);
  const double into_second = second.expansion(box);
  if (into_first != into_second) return into_first < into_second;
  if (first.volume != second.volume) return first.volume < second.volume;
  return first.branches.size() <= second.branches.size();
}

}  // namespace

SplitGroups splitQuadratic(const std::vector<Branch>& branches, int min_branches) {
  const auto fewest = static_cast<std::size_t>(min_branches);
  assert(branches.size() >= 2 * fewest && branches.size() >= 2);
  const auto [first_seed, second_seed] = pickSeeds(branches);
  Group first(branches[first_seed]);
  Group second(branches[second_seed]);
  std::vector<Branch> rest = branches;
  rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(second_seed));
  rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(first_seed));
  while (!rest.empty()) {
    std::size_t next = rest.size() - 1;
    bool to_first = first.branches.size() + rest.size() <= fewest;
    if (!to_first && second.branches.size() + rest.size() > fewest) {
      next = pickNext(rest, first, second);
      to_first = belongsToFirst(rest[next].box, first, second);
    }
    (to_first ? first : second).add(rest[next]);
    rest[next] = rest.back();
    rest.pop_back();
  }
  return {std::move(first.branches), std::move(second.branches)};
}

}  // namespace cuboid_mapping
