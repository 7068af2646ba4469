// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/scan/beam_sampling.h"

#include <array>
#include <optional>
#include <string>

namespace cuboid_mapping {

/// A face of a cell through which it may expand: S_i^x, S_i^-x, ... of the paper (Section IV-B).
struct SearchDirection {
  int axis;  ///< 0, 1, 2: x, y, z.
  int sign;  ///< 1 or -1.
};
/// Whether both are the same face.
constexpr bool operator==(const SearchDirection& a, const SearchDirection& b) {
  return a.axis == b.axis && a.sign == b.sign;
}

/// All six search directions, in the order of trial.
using SearchDirections = std::array<SearchDirection, 6>;

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
    /// Figure 5, lines 1 to 6: +x +y +z -x -y -z for a cube; else the axes by decreasing width (ties in
    /// the order x, y, z), first all upwards, then all downwards.
    kPaper,
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
  kEndPoints,  ///< End points of beams.
  kChanged,    ///< All cells whose value the cloud has changed.
};

/// Name of the starters: "sampled", "end_points" or "changed".
[[nodiscard]] const char* toString(GrowthStarters starters);

/// Parameters of the fusion of the paper, Section IV-B.
struct GrowthConfig {
  GrowthStep step = GrowthStep::kCell;  ///< Length of one expansion.
  SearchStrategy search;                ///< Order in which a cell tries the directions.
  GrowthStarters starters = GrowthStarters::kSampled;  ///< Cells that start to grow.
  BeamSampling sampling{0.1, 1};  ///< For kSampled; a random search uses its seed, too.
  int settle_clouds = 10;         ///< Clouds that a split-off voxel waits before it may fuse again.
  /// Probabilities beyond which voxels may fuse (paper, conditions (7) and (8)), at most 0.5 and at least 0.5. Nothing:
  /// the clamping thresholds, also where these are nearer to 0.5. With 0.5 and 0.5 all voxels of a class may fuse.
  ///@{
  std::optional<double> alpha_min;
  std::optional<double> alpha_max;
  ///@}
};

}  // namespace cuboid_mapping
