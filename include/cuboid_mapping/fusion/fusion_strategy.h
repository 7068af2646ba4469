// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/fusion/dense_brick.h"

#include <memory>
#include <string>
#include <vector>

namespace cuboid_mapping {

/// How neighbouring cells become cuboids after every cloud (the paper's adaptation of the grid cell
/// resolution). Implementations hold no state of the map and are thread-safe.
class FusionStrategy {
 public:
  virtual ~FusionStrategy() = default;

  /// Divides the known voxels of a brick into disjoint cuboids that cover exactly these voxels.
  ///
  /// Called for each brick that a cloud has changed.
  /// @param cuboids  Taken as empty or not; the new ones are appended.
  virtual void partition(const DenseBrick& brick, std::vector<Cuboid>& cuboids) const = 0;
};

/// No fusion: every voxel is a cuboid. The baseline.
class NoFusion : public FusionStrategy {
 public:
  void partition(const DenseBrick& brick, std::vector<Cuboid>& cuboids) const override;
};

/// Lossless fusion inside bricks: maximal boxes of equal log-odds.
///
/// Divides the voxels of each value with divideIntoBoxes(). The result depends on the voxels of the
/// brick only: not on the order of clouds.
class BrickFusion : public FusionStrategy {
 public:
  void partition(const DenseBrick& brick, std::vector<Cuboid>& cuboids) const override;
};

/// Fusion by class inside bricks: maximal boxes of free and of occupied voxels. The class of every
/// voxel is kept; its log-odds becomes that of the mean probability of its cuboid, so that later
/// observations find another value than OctoMap's.
class ClassFusion : public FusionStrategy {
 public:
  void partition(const DenseBrick& brick, std::vector<Cuboid>& cuboids) const override;
};

/// Name of GrowthFusion, which looks at the R-tree in place of single bricks.
constexpr const char* kGrowthFusion = "growth";

/// Names of all fusion strategies, the default first.
[[nodiscard]] const std::vector<std::string>& fusionNames();

/// @return Nothing for kGrowthFusion, and for a name that is not in fusionNames().
[[nodiscard]] std::unique_ptr<FusionStrategy> makeFusion(const std::string& name);

}  // namespace cuboid_mapping
