// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/map/replace_region.h"

#include "cuboid_mapping/geometry/brick.h"
#include "cuboid_mapping/rtree/traversal.h"

#include <algorithm>
#include <cassert>

namespace cuboid_mapping {
namespace {

bool isBefore(const Cuboid* a, const Cuboid* b) {
  const Cell group_a = groupOf(a->box.min);
  const Cell group_b = groupOf(b->box.min);
  return group_a == group_b ? a->box.min < b->box.min : isBeforeOnMortonCurve(group_a, group_b);
}

CellBox groupBox(const Cell& group) {
  return {group, group + Cell{kGroupEdge, kGroupEdge, kGroupEdge}};
}

/// One call of replaceRegion. A cuboid belongs to the group of its least cell.
class Replacement {
 public:
  using NewCuboids = std::vector<const Cuboid*>;

  Replacement(const CellBox& box, const MapStore& store, ChangeSet& changes)
      : box_(box), store_(store), changes_(changes) {}

  bool run(const std::vector<Cuboid>& cuboids) {
    NewCuboids sorted;
    sorted.reserve(cuboids.size());
    for (const Cuboid& cuboid : cuboids) sorted.push_back(&cuboid);
    std::sort(sorted.begin(), sorted.end(), isBefore);

    auto first = sorted.cbegin();
    for (const Cell& group : findGroups(sorted)) {
      const auto last = std::find_if(first, sorted.cend(), [&group](const Cuboid* cuboid) {
        return groupOf(cuboid->box.min) != group;
      });
      replaceGroup(group, {first, last});
      first = last;
    }
    assert(first == sorted.cend());
    // After all groups: the voxels of a new cuboid may have belonged to one of another group.
    for (const Cuboid* cuboid : added_) store_.classes.fill(cuboid->box, cuboid->occupancy());
    return is_changed_;
  }

 private:
  /// Groups of old and new cuboids, along the Morton curve.
  [[nodiscard]] std::vector<Cell> findGroups(const NewCuboids& sorted) const {
    std::vector<Cell> groups;
    const auto add = [&groups](const Cuboid& cuboid) {
      const Cell group = groupOf(cuboid.box.min);
      if (groups.empty() || groups.back() != group) groups.push_back(group);
      return Visit::kContinue;
    };
    visitBox(store_.tree, box_, CuboidFilter::kAll, add);
    for (const Cuboid* cuboid : sorted) add(*cuboid);
    std::sort(groups.begin(), groups.end(), isBeforeOnMortonCurve);
    groups.erase(std::unique(groups.begin(), groups.end()), groups.end());
    return groups;
  }

  void replaceGroup(const Cell& group, const NewCuboids& cuboids) {
    selection_.clear();
    store_.tree.select(groupBox(group), selection_);
    std::vector<LeafSlot> removed;
    std::vector<Cuboid> added;
    std::vector<char> is_kept(cuboids.size(), 0);
    for (std::size_t i = 0; i < selection_.cuboids.size(); ++i) {
      const Cuboid& old = selection_.cuboids[i];
      if (groupOf(old.box.min) != group || !old.box.intersects(box_)) continue;
      const auto same = std::lower_bound(cuboids.begin(), cuboids.end(), &old, isBefore);
      if (same != cuboids.end() && **same == old) {
        is_kept[static_cast<std::size_t>(same - cuboids.begin())] = 1;
        continue;
      }
      removed.push_back(selection_.slots[i]);
      remove(old, added);
    }
    for (std::size_t i = 0; i < cuboids.size(); ++i) {
      if (is_kept[i] != 0) continue;
      added.push_back(*cuboids[i]);
      added_.push_back(cuboids[i]);
      noteChange(*cuboids[i]);
    }
    if (removed.empty() && added.empty()) return;
    for (const Cuboid& cuboid : added) store_.content.count(cuboid, 1);
    store_.tree.replace(removed, added);
    is_changed_ = true;
  }

  /// Takes a cuboid away. @param added  Gets its parts outside the box.
  void remove(const Cuboid& old, std::vector<Cuboid>& added) {
    for (const CellBox& outside : subtract(old.box, box_)) {
      added.push_back({outside, old.log_odds});
    }
    store_.content.count(old, -1);
    store_.classes.fill(intersect(old.box, box_), Occupancy::kUnknown);
    noteChange(old);
  }

  void noteChange(const Cuboid& cuboid) {
    const CellBox part = intersect(groupBox(groupOf(cuboid.box.min)), box_);
    const CellBox& box = part.contains(cuboid.box) ? part : cuboid.box;
    if (changes_.boxes.empty() || changes_.boxes.back() != box) changes_.boxes.push_back(box);
  }

  CellBox box_;
  const MapStore& store_;
  ChangeSet& changes_;
  Selection selection_;
  NewCuboids added_;
  bool is_changed_ = false;
};

}  // namespace

bool replaceRegion(const CellBox& box, const std::vector<Cuboid>& cuboids, const MapStore& store,
                   ChangeSet& changes) {
  if (box.isEmpty()) return false;
  assert(std::all_of(cuboids.begin(), cuboids.end(), [&box](const Cuboid& cuboid) {
    return !cuboid.box.isEmpty() && box.contains(cuboid.box);
  }));
  return Replacement(box, store, changes).run(cuboids);
}

}  // namespace cuboid_mapping
