// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/boxes/box_cover.h"

#include "cuboid_mapping/boxes/box_merger.h"
#include "cuboid_mapping/boxes/cover_exchange.h"
#include "cuboid_mapping/boxes/joined_cuboids.h"
#include "cuboid_mapping/boxes/passages.h"
#include "cuboid_mapping/geometry/box_faces.h"

#include <algorithm>
#include <map>
#include <utility>

namespace cuboid_mapping {
namespace {

double sumOfVolumes(const std::vector<CellBox>& boxes) {
  double sum = 0.0;
  for (const CellBox& box : boxes) sum += box.numVoxels();
  return sum;
}

bool isLarger(const CellBox& a, const CellBox& b) {
  if (a.numVoxels() != b.numVoxels()) return a.numVoxels() > b.numVoxels();
  return a.min != b.min ? a.min < b.min : a.max < b.max;
}

/// The boxes without the cells of the holes; of some holes if the budget is spent.
std::vector<CellBox> without(std::vector<CellBox> boxes, const std::vector<CellBox>& holes,
                             Budget& budget) {
  for (const CellBox& hole : holes) {
    if (!budget.spendAndUnlock(boxes.size() / kBoxesPerBrick)) break;
    boxes = subtractAll(std::move(boxes), {hole});
  }
  return boxes;
}

/// Unchanged boxes at their places in an earlier list, the others, the largest first, in the gaps and at the end.
std::vector<CellBox> inOrderOf(const std::vector<CellBox>& previous, std::vector<CellBox> boxes) {
  std::sort(boxes.begin(), boxes.end(), isLarger);
  std::vector<CellBox> ordered(boxes.size());
  std::vector<CellBox> others;
  std::map<std::pair<Cell, Cell>, std::size_t> places;  // The first one of each box.
  for (std::size_t i = 0; i < previous.size(); ++i) {
    places.emplace(std::pair(previous[i].min, previous[i].max), i);
  }
  for (const CellBox& box : boxes) {
    const auto place = places.find({box.min, box.max});
    if (place != places.end() && place->second < ordered.size() &&
        ordered[place->second].isEmpty()) {
      ordered[place->second] = box;
    } else {
      others.push_back(box);
    }
  }
  auto next = others.begin();
  for (CellBox& box : ordered) {
    if (box.isEmpty()) box = *next++;
  }
  return ordered;
}

/// A copy of the voxels of a region, which others do not change during the search; of some if the budget is spent.
CuboidMap copyOf(const CuboidMap& map, const CellBox& region, Budget& budget) {
  constexpr std::size_t kAtOnce = 4096;
  MapConfig config = map.config();
  config.fusion = FusionKind::kClass;
  config.fuse = FusionTime::kWhenRead;
  CuboidMap copy(config);
  std::vector<VoxelBrick> bricks;
  const auto put = [&] { copy.replace(std::exchange(bricks, {})); };
  map.voxels().visitIn(region, [&](const VoxelBrick& brick) {
    if (!budget.spend()) return Visit::kStop;
    bricks.push_back(brick);
    if (bricks.size() == kAtOnce) put();
    return Visit::kContinue;
  });
  put();
  return copy;
}

/// Looks for covers of the same voxels beside more and more kept space.
class CoverSearch {
 public:
  CoverSearch(const CuboidMap& map, const CoverTask& task, const std::vector<CellBox>& occupied,
              Budget& budget)
      : task_(task),
        occupied_(occupied),
        cost_(map),
        voxels_(budget, occupied),
        budget_(budget),
        max_boxes_(task.max_boxes),
        keep_free_(task.keep_free) {}

  void run() {
    boxes_ = findBoxes();
    const std::vector<CellBox> last = findFromPrevious();
    constexpr double kWorth = 1.1;  // Differences cost others more than a tenth of the volume.
    const bool is_worth = !last.empty() && costOf(last) <= kWorth * costOf(boxes_);
    if (is_worth && !budget_.isSpent()) boxes_ = last;
  }

  /// Looks for boxes that cut a robot off nowhere, or at as few places as possible. Once the budget is spent, the
  /// boxes found before stay.
  void keepPassages(Passages& passages) {
    constexpr int kFewRounds = 3;
    constexpr int kManyRounds = 40;
    constexpr std::size_t kMostUnited = 100;  // All pairs of boxes are compared.
    lost_ = passages.findLost(coverOf(boxes_));
    keepWays(passages, kFewRounds);
    if (lost_.empty()) return;
    if (task_.max_boxes <= kMostUnited && uniteBeside(passages)) return;
    keepWays(passages, kManyRounds);
  }

  [[nodiscard]] const std::vector<CellBox>& boxes() const { return boxes_; }
  [[nodiscard]] const std::vector<LostPassage>& lost() const { return lost_; }
  /// Counted whole, also when the budget is spent.
  [[nodiscard]] double numAdded() const {
    return VoxelSet(Budget::unlimited(), boxes_).size() - voxels_.size();
  }

 private:
  /// Keeps ways free where the boxes cut a robot off, as far as max_boxes_ allow.
  void keepWays(Passages& passages, int num_rounds) {
    constexpr std::size_t kAtOnce = 2;
    for (int round = 0; round < num_rounds && !lost_.empty() && budget_.checkClock(); ++round) {
      std::vector<CellBox> boxes_before = boxes_;
      std::vector<LostPassage> lost_before = lost_;
      for (std::size_t i = 0; i < std::min(kAtOnce, lost_.size()); ++i) {
        keep_free_.insert(keep_free_.end(), lost_[i].way.begin(), lost_[i].way.end());
      }
      run();
      lost_ = passages.findLost(coverOf(boxes_));
      const bool are_few = boxes_.size() <= std::max(max_boxes_, boxes_before.size());
      if (are_few && !budget_.isSpent()) continue;
      boxes_.swap(boxes_before);
      lost_.swap(lost_before);
      return;
    }
  }

  /// Begins with three times as many boxes, beside which ways stay open at little cost, and unites two by two while they do: few boxes
  /// close so much that ways between them are found only far from the best. @return Whether max_boxes suffice; else
  /// nothing changes.
  bool uniteBeside(Passages& passages) {
    const std::vector<CellBox> boxes_before = boxes_;
    const std::vector<LostPassage> lost_before = lost_;
    const std::vector<CellBox> keep_free_before = keep_free_;
    keep_free_ = task_.keep_free;
    max_boxes_ *= 3;
    run();
    lost_ = passages.findLost(coverOf(boxes_));
    constexpr int kRounds = 20;
    keepWays(passages, kRounds);
    max_boxes_ = task_.max_boxes;
    const auto is_open = [&](const std::vector<CellBox>& boxes) {
      return passages.findLost(coverOf(boxes)).empty() && !budget_.isSpent();
    };
    BoxMerger merger(boxes_, keep_free_, cost_, budget_, is_open);
    if (lost_.empty()) merger.mergeTo(max_boxes_);
    if (merger.boxes().size() > max_boxes_) {
      boxes_ = boxes_before;
      lost_ = lost_before;
      keep_free_ = keep_free_before;
      return false;
    }
    CoverExchange exchange(voxels_, merger.boxes(), keep_free_, cost_, budget_, is_open);
    exchange.improve(max_boxes_);
    boxes_ = exchange.boxes();
    return true;
  }

  [[nodiscard]] VoxelSet coverOf(const std::vector<CellBox>& boxes) const {
    return VoxelSet(budget_, boxes);
  }

  [[nodiscard]] double costOf(const std::vector<CellBox>& boxes) const {
    return cost_.ofCover(coverOf(boxes), voxels_.size());
  }

  [[nodiscard]] std::vector<CellBox> findBoxes() const {
    BoxMerger merger(occupied_, keep_free_, cost_, budget_);
    merger.mergeTo(max_boxes_);
    if (!merger.hasMerged()) return merger.boxes();
    CoverExchange exchange(voxels_, merger.boxes(), keep_free_, cost_, budget_);
    exchange.improve(max_boxes_);
    return exchange.boxes();
  }

  /// The boxes of the last answer that may stay, and more for the voxels outside; none if these are too many.
  [[nodiscard]] std::vector<CellBox> findFromPrevious() const {
    std::vector<CellBox> boxes;
    for (const CellBox& box : task_.previous) {
      const bool may_stay = !box.isEmpty() && task_.region.contains(box) &&
                            isAllowed(box, keep_free_, budget_) && voxels_.count(box) > 0.0;
      if (may_stay) boxes.push_back(box);
    }
    if (boxes.empty()) return {};
    const std::vector<CellBox> others = without(occupied_, boxes, budget_);
    boxes.insert(boxes.end(), others.begin(), others.end());
    BoxMerger merger(boxes, keep_free_, cost_, budget_);
    merger.mergeTo(max_boxes_);
    return merger.boxes().size() <= max_boxes_ ? merger.boxes() : std::vector<CellBox>();
  }

  const CoverTask& task_;
  const std::vector<CellBox>& occupied_;
  CoverCost cost_;
  VoxelSet voxels_;
  Budget& budget_;
  std::size_t max_boxes_;
  std::vector<CellBox> keep_free_;
  std::vector<CellBox> boxes_;
  std::vector<LostPassage> lost_;
};

}  // namespace

Answer<BoxCover> coverOccupied(const CuboidMap& map, const CoverTask& task, Budget& budget) {
  const bool has_robot = !task.keep_passages_m.isZero(0.0);
  const auto robot = map.grid().toSizeInCells(task.keep_passages_m);
  if (task.max_boxes == 0 || task.region.isEmpty() || (has_robot && !robot)) {
    return Answer<BoxCover>::invalid(
        "max_boxes must be > 0, the region not empty, and the edges of keep_passages finite and > "
        "0, or all 0");
  }
  const CuboidMap still = copyOf(map, task.region, budget);
  if (budget.isSpent()) return AnswerStatus::kBudgetSpent;
  std::vector<CellBox> occupied;
  const auto joined = joinCuboids(still, task.region, CuboidFilter::kOccupied, budget);
  for (const Cuboid& cuboid : joined.value) occupied.push_back(cuboid.box);
  const double num_occupied = sumOfVolumes(occupied);
  occupied = without(std::move(occupied), task.keep_free, budget);
  const double num_covered = sumOfVolumes(occupied);

  CoverSearch search(still, task, occupied, budget);
  if (budget.isSpent()) return AnswerStatus::kBudgetSpent;
  search.run();
  if (has_robot && search.numAdded() > 0.0) {
    Passages passages(still, task.region, *robot, budget);
    search.keepPassages(passages);
  }
  const bool is_cut = budget.isSpent();
  const bool are_too_many = search.boxes().size() > task.max_boxes;
  if (is_cut ? are_too_many : !budget.addEntries(search.boxes().size())) {
    return AnswerStatus::kBudgetSpent;
  }
  BoxCover cover;
  cover.boxes = inOrderOf(task.previous, search.boxes());
  for (const LostPassage& passage : search.lost()) cover.lost.push_back(passage.place);
  const double voxel_volume_m3 = map.grid().voxelVolume();
  cover.occupied_volume_m3 = num_covered * voxel_volume_m3;
  cover.added_volume_m3 = search.numAdded() * voxel_volume_m3;
  cover.left_out_volume_m3 = (num_occupied - num_covered) * voxel_volume_m3;
  if (is_cut) return {AnswerStatus::kBudgetSpent, std::move(cover)};
  if (are_too_many) return {AnswerStatus::kNotFound, std::move(cover)};
  return cover;
}

}  // namespace cuboid_mapping
