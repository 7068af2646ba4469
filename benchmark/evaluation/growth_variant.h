// SPDX-License-Identifier: BSD-3-Clause
// Growth with other rules where the paper is open, or names future work.
#pragma once

#include "cuboid_mapping/fusion/growth_config.h"
#include "cuboid_mapping/fusion/growth_rules.h"

#include <memory>
#include <optional>
#include <string>

namespace cuboid_mapping::bench {

/// Length of one expansion. The paper's equation 5 (width of the cell, times a unit vector
/// "scaled based on width") can be read both ways.
enum class GrowthStep : unsigned char {
  kCell,      ///< Grows by one voxel.
  kOwnWidth,  ///< Grows by the cell's width along the direction: it doubles.
  /// Grows by the width of the neighbor at the least corner of the face, so that fused cuboids can absorb each
  /// other. Not in the paper.
  kNeighbour,
};

/// Name of a step: "cell", "own_width" or "neighbour".
[[nodiscard]] const char* toString(GrowthStep step);

/// Order in which a cell tries the search directions (paper, Figure 5; other orders are its future work).
struct SearchStrategy {
  /// The rule that gives the order.
  enum class Order : unsigned char {
    kPaper,        ///< paperDirections().
    kFixed,        ///< The order of `directions`.
    kLargestGain,  ///< First the expansion that absorbs the most cells; ties as in Figure 5.
    kRandom,       ///< Shuffled anew for each expansion, from a seed and the cell.
  };
  Order order = Order::kPaper;    ///< Rule of the order.
  SearchDirections directions{};  ///< Directions of kFixed.
};

/// "paper", "largest_gain", "random", or the six directions in any order as in "+z -z +x +y -x -y".
/// @return Nothing for any other text, or if a direction is missing or comes twice.
[[nodiscard]] std::optional<SearchStrategy> parseSearchStrategy(const std::string& text);

/// Inverse of parseSearchStrategy().
[[nodiscard]] std::string toText(const SearchStrategy& strategy);

/// Cells that start to grow after a cloud (the paper's set T).
enum class GrowthStarters : unsigned char {
  kSampled,    ///< End points of beams, and random cells along the beams: the paper.
  kEndPoints,  ///< End points of beams: the paper without random cells.
  kChanged,    ///< All cells whose value the cloud has changed.
};

/// Name of the starters: "sampled", "end_points" or "changed".
[[nodiscard]] const char* toString(GrowthStarters starters);

/// The rules of a run; by default those of the product.
struct GrowthVariant {
  GrowthStep step = GrowthStep::kCell;  ///< Length of one expansion.
  SearchStrategy search;                ///< Order in which a cell tries the directions.
  GrowthStarters starters = GrowthStarters::kSampled;  ///< Cells that start to grow.
};

/// For GrowthConfig::rules. @param seed  Of a random search.
[[nodiscard]] std::shared_ptr<const GrowthRules> makeRules(const GrowthVariant& variant, int seed);

}  // namespace cuboid_mapping::bench
