// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/growth_variant.h"

#include "cuboid_mapping/voxels/brick_store.h"

#include <algorithm>
#include <random>
#include <sstream>
#include <utility>

namespace cuboid_mapping::bench {
namespace {

std::optional<SearchDirection> parseDirection(const std::string& word) {
  if (word.size() != 2) return std::nullopt;
  const std::size_t axis = std::string("xyz").find(word[1]);
  const std::size_t sign = std::string("+-").find(word[0]);
  if (axis == std::string::npos || sign == std::string::npos) return std::nullopt;
  return SearchDirection{static_cast<int>(axis), sign == 0 ? 1 : -1};
}

std::optional<SearchDirections> parseDirections(const std::string& text) {
  SearchDirections directions{};
  auto end = directions.begin();
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    const auto direction = parseDirection(word);
    if (!direction || end == directions.end()) return std::nullopt;
    const auto is_same = [&direction](const SearchDirection& other) {
      return other.axis == direction->axis && other.sign == direction->sign;
    };
    if (std::any_of(directions.begin(), end, is_same)) return std::nullopt;
    *end++ = *direction;
  }
  if (end != directions.end()) return std::nullopt;
  return directions;
}

/// See GrowthVariant.
class VariantRules : public GrowthRules {
 public:
  VariantRules(const GrowthVariant& variant, int seed) : variant_(variant), seed_(seed) {}

  [[nodiscard]] std::vector<Cell> startersOf(const VoxelStore::PendingChange& change,
                                             const std::vector<BrickUpdate>& observed,
                                             const std::vector<Cell>& samples) const override {
    if (variant_.starters != GrowthStarters::kChanged) {
      return GrowthRules::startersOf(change, observed, samples);
    }
    std::vector<Cell> cells;
    for (const std::uint32_t i : change.changed) {
      forEachCell(change.bricks[i].brick, change.bricks[i].changed,
                  [&cells](const Cell& cell) { cells.push_back(cell); });
    }
    return cells;
  }

  [[nodiscard]] bool expand(GrowingBricks& bricks, GrowingCell& cell) const override {
    if (variant_.search.order == SearchStrategy::Order::kLargestGain) {
      return expandMost(bricks, cell);
    }
    for (const SearchDirection direction : directionsOf(cell.box)) {
      if (tryDirection(direction, bricks, cell)) return true;
    }
    return false;
  }

  [[nodiscard]] bool reachesFar() const override { return variant_.step != GrowthStep::kCell; }

 private:
  [[nodiscard]] bool expandMost(GrowingBricks& bricks, GrowingCell& cell) const {
    std::optional<GrowingCell> best;
    double most = 0.0;
    for (const SearchDirection direction : paperDirections(cell.box.size())) {
      GrowingCell next{cell.box, cell.occupancy, {}};
      if (!tryDirection(direction, bricks, next)) continue;
      double num_absorbed = next.box.numVoxels() - cell.box.numVoxels();
      for (const CellBox& box : next.absorbed) num_absorbed -= box.numVoxels() - 1.0;
      if (best && num_absorbed <= most) continue;
      most = num_absorbed;
      best = std::move(next);
    }
    if (!best) return false;
    cell.box = best->box;
    cell.absorbed.insert(cell.absorbed.end(), best->absorbed.begin(), best->absorbed.end());
    return true;
  }

  [[nodiscard]] bool tryDirection(SearchDirection direction, GrowingBricks& bricks,
                                  GrowingCell& cell) const {
    const int axis = direction.axis;
    const CellBox next = slabOf(cell.box, direction, 1);
    if (!bricks.isAllFusible(next, cell.occupancy)) return false;
    std::int32_t depth = 1;
    if (variant_.step == GrowthStep::kOwnWidth) depth = cell.box.size()[axis];
    if (variant_.step == GrowthStep::kNeighbour) {
      const CellBox neighbour = bricks.cuboidAt(next.min).box;
      depth = direction.sign > 0 ? neighbour.max[axis] - cell.box.max[axis]
                                 : cell.box.min[axis] - neighbour.min[axis];
    }
    return absorbSlab(slabOf(cell.box, direction, depth), bricks, cell);
  }

  [[nodiscard]] SearchDirections directionsOf(const CellBox& box) const {
    if (variant_.search.order == SearchStrategy::Order::kFixed) return variant_.search.directions;
    if (variant_.search.order != SearchStrategy::Order::kRandom) {
      return paperDirections(box.size());
    }
    SearchDirections directions = paperDirections({1, 1, 1});
    std::mt19937_64 random(static_cast<std::uint64_t>(seed_) + CellHash()(box.min) +
                           3 * CellHash()(box.max));
    for (std::size_t left = directions.size(); left > 1; --left) {
      std::swap(directions[left - 1], directions[random() % left]);
    }
    return directions;
  }

  GrowthVariant variant_;
  int seed_;
};

}  // namespace

std::optional<SearchStrategy> parseSearchStrategy(const std::string& text) {
  using Order = SearchStrategy::Order;
  if (text == "paper") return SearchStrategy{Order::kPaper, {}};
  if (text == "largest_gain") return SearchStrategy{Order::kLargestGain, {}};
  if (text == "random") return SearchStrategy{Order::kRandom, {}};
  const auto directions = parseDirections(text);
  if (!directions) return std::nullopt;
  return SearchStrategy{Order::kFixed, *directions};
}

const char* toString(GrowthStarters starters) {
  switch (starters) {
    case GrowthStarters::kSampled: return "sampled";
    case GrowthStarters::kEndPoints: return "end_points";
    case GrowthStarters::kChanged: break;
  }
  return "changed";
}

const char* toString(GrowthStep step) {
  switch (step) {
    case GrowthStep::kCell: return "cell";
    case GrowthStep::kOwnWidth: return "own_width";
    case GrowthStep::kNeighbour: break;
  }
  return "neighbour";
}

std::string toText(const SearchStrategy& strategy) {
  switch (strategy.order) {
    case SearchStrategy::Order::kPaper: return "paper";
    case SearchStrategy::Order::kLargestGain: return "largest_gain";
    case SearchStrategy::Order::kRandom: return "random";
    case SearchStrategy::Order::kFixed: break;
  }
  std::string text;
  for (const SearchDirection& direction : strategy.directions) {
    text += text.empty() ? "" : " ";
    text += direction.sign > 0 ? '+' : '-';
    text += "xyz"[direction.axis];
  }
  return text;
}

std::shared_ptr<const GrowthRules> makeRules(const GrowthVariant& variant, int seed) {
  return std::make_shared<const VariantRules>(variant, seed);
}

}  // namespace cuboid_mapping::bench
