// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/boxes/free_boxes.h"

#include "cuboid_mapping/boxes/joined_cuboids.h"
#include "cuboid_mapping/geometry/box_faces.h"
#include "cuboid_mapping/query/voxel_set.h"

#include <algorithm>
#include <array>
#include <queue>

namespace cuboid_mapping {
namespace {

constexpr std::size_t kSeedsAtOnce = 1000;

/// Voxels from a face to the border of the next brick.
std::int32_t toNextBrick(const CellBox& box, int face) {
  const int axis = face % 3;
  return face < 3 ? ((box.min[axis] - 1) & (kBrickEdge - 1)) + 1
                  : kBrickEdge - (box.max[axis] & (kBrickEdge - 1));
}

/// Grows a box in a set until no face can move; each step moves the face that adds the most.
CellBox grow(const VoxelSet& voxels, CellBox box) {
  std::array<bool, 6> is_blocked{};
  while (true) {
    CellBox best = box;
    for (int face = 0; face < 6; ++face) {
      if (is_blocked[static_cast<std::size_t>(face)]) continue;
      const auto try_slab = [&](std::int32_t thickness) {
        const CellBox slab = slabBeyond(box, face, thickness);
        const CellBox grown = unite(box, slab);
        const bool is_free = voxels.contains(slab);
        if (is_free && grown.numVoxels() > best.numVoxels()) best = grown;
        return is_free;
      };
      // An obstacle that blocks one voxel blocks the face of every larger box, too.
      if (!try_slab(toNextBrick(box, face)) && !try_slab(1)) {
        is_blocked[static_cast<std::size_t>(face)] = true;
      }
    }
    if (best == box) return box;
    box = best;
  }
}

/// Greedy search: takes the box with the greatest gain, again and again.
class FreeBoxSearch {
 public:
  FreeBoxSearch(const CuboidMap& map, const FreeBoxesTask& task, Budget& budget)
      : budget_(budget), free_(budget), left_(budget), may_overlap_(task.may_overlap) {
    const auto joined = joinCuboids(map, task.region, CuboidFilter::kFree, budget);
    for (const Cuboid& cuboid : joined.value) {
      seeds_.push_back(cuboid.box);
      free_.add(cuboid.box);
      left_.add(cuboid.box);
    }
    std::stable_sort(seeds_.begin(), seeds_.end(), [](const CellBox& a, const CellBox& b) {
      return a.numVoxels() > b.numVoxels();
    });
  }

  void run(std::size_t max_boxes) {
    while (boxes_.size() < max_boxes && budget_.checkClock()) {
      if (queue_.empty() && !plantSeeds()) return;
      if (queue_.empty()) continue;
      const Candidate candidate = queue_.top();
      queue_.pop();
      const Candidate now = may_overlap_ ? recount(candidate) : regrow(candidate);
      if (now.gain <= 0.0) continue;
      if (!queue_.empty() && now < queue_.top()) {
        queue_.push(now);
      } else {
        boxes_.push_back(now.box);
        left_.remove(now.box);
      }
    }
  }

  [[nodiscard]] const std::vector<CellBox>& boxes() const { return boxes_; }
  [[nodiscard]] double numFree() const { return free_.size(); }
  [[nodiscard]] double numLeft() const { return left_.size(); }

 private:
  struct Candidate {
    double gain;
    CellBox box;
    CellBox seed;

    bool operator<(const Candidate& other) const {
      if (gain != other.gain) return gain < other.gain;
      return other.box.min != box.min ? other.box.min < box.min : other.seed.min < seed.min;
    }
  };

  /// Grows the next seeds. @return Whether there were any.
  bool plantSeeds() {
    if (num_planted_ == seeds_.size()) return false;
    const std::size_t end = std::min(seeds_.size(), num_planted_ + kSeedsAtOnce);
    for (; num_planted_ < end && budget_.spend(); ++num_planted_) plant(seeds_[num_planted_]);
    return true;
  }

  void plant(const CellBox& seed) {
    if (!may_overlap_ && !left_.contains(seed)) {
      if (budget_.isSpent()) return;  // It was not looked up: no box may have taken a part of it.
      for (const CellBox& piece : subtractAll({seed}, boxes_)) plant(piece);
      return;
    }
    const CellBox box = grow(may_overlap_ ? free_ : left_, seed);
    queue_.push({box.numVoxels(), box, seed});
  }

  [[nodiscard]] Candidate recount(Candidate candidate) const {
    candidate.gain = left_.count(candidate.box);
    return candidate;
  }

  /// The candidate itself if no voxel was taken since; else its seed is grown again.
  [[nodiscard]] Candidate regrow(const Candidate& candidate) {
    if (left_.contains(candidate.box)) return candidate;
    plant(candidate.seed);
    return {0.0, {}, {}};
  }

  Budget& budget_;
  VoxelSet free_;
  VoxelSet left_;  ///< Free voxels in no box.
  bool may_overlap_;
  std::vector<CellBox> seeds_;  ///< Seeds, largest first.
  std::size_t num_planted_ = 0;
  std::priority_queue<Candidate> queue_;
  std::vector<CellBox> boxes_;
};

}  // namespace

Answer<FreeBoxes> findFreeBoxes(const CuboidMap& map, const FreeBoxesTask& task, Budget& budget) {
  if (task.max_boxes == 0 || task.region.isEmpty()) {
    return Answer<FreeBoxes>::invalid("max_boxes must be > 0, and the region not empty");
  }
  FreeBoxSearch search(map, task, budget);
  search.run(task.max_boxes);
  if (budget.isSpent() || !budget.addEntries(search.boxes().size())) {
    return AnswerStatus::kBudgetSpent;
  }
  if (search.boxes().empty()) return AnswerStatus::kNotFound;
  FreeBoxes found;
  found.boxes = search.boxes();
  const double voxel_volume_m3 = map.grid().voxelVolume();
  found.covered_volume_m3 = (search.numFree() - search.numLeft()) * voxel_volume_m3;
  found.missing_volume_m3 = search.numLeft() * voxel_volume_m3;
  return found;
}

}  // namespace cuboid_mapping
