// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace cuboid_mapping {

constexpr std::size_t kNumFaces = 6;

/// Beams that must cross a column for it to be cheaper than their walk from there on. These are fewer than the slabs that
/// it costs (kColumn in cloud_columns.cpp), since a beam that leaves the columns is first set up for the walk.
constexpr double kMinBeamsPerColumn = 10.0;

/// A beam of a face. Slopes are voxels across per voxel along.
struct FaceBeam {
  float slopes[2];
  std::uint32_t num_planes;  ///< Planes that it crosses: voxel borders along the face's axis.
  std::uint32_t end;         ///< Index of its end in the cloud.
};

/// The beams with one longest axis and one direction on it, as seen from the origin of a cloud.
///
/// Depth is the distance from the origin along the axis. Slab 0 holds the origin, and plane k lies between
/// slabs k and k + 1. A column is a row of voxels along the axis. Columns are numbered from the corner of the
/// origin's brick, so that 8 x 8 of them fill bricks. All lengths are in voxels.
struct Face {
  int axis = 0;
  std::array<int, 2> across{};     ///< The other axes, in the order of their numbers.
  bool is_down = false;            ///< Whether the beams go down the axis.
  double first_depth = 0.0;        ///< Depth of plane 0.
  std::array<double, 2> origin{};  ///< Place of the origin among the columns: 0 to 8.
  std::array<int, 2> column{};     ///< The origin's.
  /// From the origin to the borders of its column, down and up: where walkRay() has these, see RayOrigin::toBorder().
  std::array<std::array<double, 2>, 2> to_borders{};

  /// @param plane  -1 for the origin.
  [[nodiscard]] double depthOf(int plane) const { return plane < 0 ? 0.0 : first_depth + plane; }
  /// From the origin to the lower border of a column, on an axis across.
  [[nodiscard]] double toBorder(std::size_t i, int of) const {
    return of > column[i] ? to_borders[i][1] + (of - column[i] - 1)
                          : to_borders[i][0] + (of - column[i]);
  }
};

/// Greatest distance across between the place of a beam as computed from its slopes, and as walkRay() has it.
///
/// A slope is a quotient of float32 components that walkRay() divides by the length first: five roundings of
/// 2^-24 each, one more for the product. Bins add three. An origin, a border and the far end add less than
/// 2^-19: float32 half voxels, and doubles of up to 2^30 voxels.
template <typename NumberT>
[[nodiscard]] constexpr NumberT acrossMargin(NumberT depth) {
  return (depth + 8) * (NumberT{1} / (1 << 19));
}
/// The same in doubles, and from Face::toBorder(): the constant is the rounding of borders next to the origin.
[[nodiscard]] constexpr double walkMargin(double depth) { return depth / (1 << 19) + 1e-12; }

/// The beams of a face in bins of slopes, with a pyramid of the most planes that a beam of a node crosses.
class FaceBeams {
 public:
  /// A range of bins on both axes: the first and the last.
  struct Bins {
    int first[2];
    int last[2];
  };

  /// Puts beams into about half as many bins. @param beams  Swapped with the memory of earlier beams.
  void sort(const Face& face, std::vector<FaceBeam>& beams);

  /// Planes that all beams cross together: those of the beam that crosses the most.
  [[nodiscard]] int maxPlanes() const {
    return beams_.empty() ? 0 : levels_.back().most_planes.front();
  }

  [[nodiscard]] const Face& face() const { return face_; }
  [[nodiscard]] const std::vector<FaceBeam>& beams() const { return beams_; }

  /// Planes, from the first, at which columns are cheaper than the walk: where some beams share each.
  [[nodiscard]] int numDensePlanes() const { return num_dense_planes_; }

  /// Columns that beams may cross at some depth, on an axis across: the first and the last.
  [[nodiscard]] std::array<int, 2> columnsAt(double depth, std::size_t across) const;

  /// Bins with slopes between two columns' borders at a depth, on one axis.
  ///@{
  [[nodiscard]] int firstBin(double slope, std::size_t across) const;
  [[nodiscard]] int lastBin(double slope, std::size_t across) const;
  [[nodiscard]] int firstWholeBin(double slope, std::size_t across) const;
  [[nodiscard]] int lastWholeBin(double slope, std::size_t across) const;
  ///@}

  [[nodiscard]] int numLevels() const { return static_cast<int>(levels_.size()); }
  /// The lowest level with less than so many nodes in a range of slopes.
  [[nodiscard]] int levelOf(double slopes, double num_nodes) const;
  /// Nodes with a beam that crosses a plane: bit i for node (x + i, y). @param x  >= 0.
  [[nodiscard]] std::uint64_t nodesThatReach(int level, int x, int y, int plane) const;
  /// Whether a beam of these nodes crosses a plane.
  [[nodiscard]] bool anyReaches(int level, const Bins& nodes, int plane) const;

  /// Whether a beam that crosses `plane` lies in a node inside `whole`, or makes is_found(beam) true. Asks for
  /// beams of bins in `bins`, which holds `whole`.
  ///@{
  template <typename PredicateT>
  [[nodiscard]] bool anyBeam(const Bins& bins, const Bins& whole, int plane,
                             PredicateT is_found) const {
    int level = 0;  // Of at most 2 x 2 nodes that hold the bins.
    const int bins_across = std::max(bins.last[0] - bins.first[0], bins.last[1] - bins.first[1]);
    while (level + 1 < numLevels() && bins_across >> level > 0) ++level;
    for (int y = bins.first[1] >> level; y <= bins.last[1] >> level; ++y) {
      for (int x = bins.first[0] >> level; x <= bins.last[0] >> level; ++x) {
        if (anyBeamOf(level, x, y, bins, whole, plane, is_found)) return true;
      }
    }
    return false;
  }
  /// Of one node.
  template <typename PredicateT>
  [[nodiscard]] bool anyBeamOf(int level, int x, int y, const Bins& bins, const Bins& whole,
                               int plane, PredicateT& is_found) const {
    const Level& nodes = levels_[static_cast<std::size_t>(level)];
    if (x >= nodes.size[0] || y >= nodes.size[1]) return false;
    const auto node = static_cast<std::size_t>(y) * static_cast<std::size_t>(nodes.size[0]) +
                      static_cast<std::size_t>(x);
    if (nodes.most_planes[node] <= plane) return false;
    const int first[2] = {x << level, y << level};
    const int last[2] = {first[0] + (1 << level) - 1, first[1] + (1 << level) - 1};
    bool is_whole = true;
    for (int i = 0; i < 2; ++i) {
      if (first[i] > bins.last[i] || last[i] < bins.first[i]) return false;
      is_whole &= first[i] >= whole.first[i] && last[i] <= whole.last[i];
    }
    if (is_whole) return true;
    if (level > 0) {
      for (int i = 0; i < 4; ++i) {
        if (anyBeamOf(level - 1, 2 * x + (i & 1), 2 * y + (i >> 1), bins, whole, plane, is_found)) {
          return true;
        }
      }
      return false;
    }
    for (std::uint32_t i = first_beams_[node]; i != kNone; i = next_beams_[i]) {
      if (static_cast<int>(beams_[i].num_planes) > plane && is_found(beams_[i])) return true;
    }
    return false;
  }
  ///@}

 private:
  static constexpr std::uint32_t kNone = ~std::uint32_t{0};

  struct Level {
    int size[2];
    std::vector<std::int16_t> most_planes;  ///< With 63 more, so that 64 can be loaded.
  };

  void chooseBins();
  void buildPyramid();
  void countDensePlanes();
  [[nodiscard]] int binOf(float slope, std::size_t across) const {
    return static_cast<int>((slope - least_[across]) * bins_per_slope_);
  }

  Face face_;
  std::array<float, 2> least_{};
  std::array<float, 2> greatest_{};
  float bins_per_slope_ = 1.0F;
  std::vector<FaceBeam> beams_;
  /// By bin; lists of beams that next_beams_ goes on with.
  std::vector<std::uint32_t> first_beams_;
  std::vector<std::uint32_t> next_beams_;
  std::vector<Level> levels_;
  int num_dense_planes_ = 0;
};

}  // namespace cuboid_mapping
