// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/fusion/search_directions.h"

#include <algorithm>
#include <sstream>
#include <utility>

namespace cuboid_mapping {
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
    if (std::find(directions.begin(), end, *direction) != end) return std::nullopt;
    *end++ = *direction;
  }
  if (end != directions.end()) return std::nullopt;
  return directions;
}

}  // namespace

SearchDirections paperDirections(const Cell& width) {
  std::array<int, 3> axes{0, 1, 2};
  // By insertion: std::stable_sort would allocate memory.
  for (const std::size_t i : {1U, 2U, 1U}) {
    if (width[axes[i]] > width[axes[i - 1]]) std::swap(axes[i], axes[i - 1]);
  }
  return {{{axes[0], 1}, {axes[1], 1}, {axes[2], 1}, {axes[0], -1}, {axes[1], -1}, {axes[2], -1}}};
}

CellBox slabOf(const CellBox& box, SearchDirection direction, std::int32_t depth) {
  const int axis = direction.axis;
  CellBox slab = box;
  if (direction.sign > 0) {
    slab.min[axis] = box.max[axis];
    slab.max[axis] = box.max[axis] + depth;
  } else {
    slab.min[axis] = box.min[axis] - depth;
    slab.max[axis] = box.min[axis];
  }
  return slab;
}

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

}  // namespace cuboid_mapping
