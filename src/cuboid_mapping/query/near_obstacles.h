// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/query/body_shapes.h"
#include "cuboid_mapping/query/obstacle_cache.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

namespace cuboid_mapping {

/// An obstacle of a brick that a shape meets.
template <typename ShapeT>
[[nodiscard]] std::optional<Cell> findMetInBrick(const ShapeT& shape,
                                                 const BrickObstacles& obstacles) {
  const CellBox part = intersect(shape.bounds(), obstacles.box);
  if (part.isEmpty()) return std::nullopt;
  CellBox slice = part;
  slice.max.z = slice.min.z + 1;
  const Cell& brick = obstacles.brick;
  const std::uint64_t columns = BrickMask::ofBox(slice)[slice.min.z - brick.z];
  for (std::int32_t z = part.min.z; z < part.max.z; ++z) {
    for (std::uint64_t left = obstacles.voxels[z - brick.z] & columns; left != 0;
         left &= left - 1) {
      const int column = __builtin_ctzll(left);
      const Cell voxel{brick.x + column % kBrickEdge, brick.y + column / kBrickEdge, z};
      if (shape.meets(Cube::of(voxel, 1.0))) return voxel;
    }
  }
  return std::nullopt;
}

/// An obstacle that a shape meets, brick by brick; nothing, too, if the budget of the cache is spent.
template <typename ShapeT>
[[nodiscard]] std::optional<Cell> findMetByBrick(const ShapeT& shape, ObstacleCache& cache) {
  std::optional<Cell> met;
  (void)anyBrick(shape.bounds(), [&](const Cell& brick) {
    cache.trim();
    const BrickObstacles* obstacles = cache.find(brick);
    if (cache.budget().isSpent()) return true;
    if (obstacles != nullptr && shape.meets(Cube::of(brick, kBrickEdge))) {
      met = findMetInBrick(shape, *obstacles);
    }
    return met.has_value();
  });
  return met;
}

/// The bricks with obstacles around a ball, kept for the balls after it: those of an arm lie close together, and meet
/// few of these bricks.
class NearObstacles {
 public:
  /// @param cache  Must outlive this object.
  explicit NearObstacles(ObstacleCache& cache) : cache_(cache) { near_.reserve(64); }

  /// An obstacle that a ball meets, valid until the next call; null: none, or the budget is spent.
  [[nodiscard]] const Cell* findMet(const Ball& ball) {
    if (has_met_ && ball.meets(Cube::of(met_, 1.0))) return &met_;
    has_met_ = false;
    if (ball.radius() > kMaxRadius) return keep(findMetByBrick(ball, cache_));
    const float reach = static_cast<float>(ball.radius()) + kRounding;
    Eigen::Array3f center = placeOf(ball);
    if (isInFree(center, reach)) return nullptr;
    if (generation_ != cache_.generation() || roomAround(center) < reach) {
      if (isMetAtCenter(ball)) return &met_;
      moveTo(ball);
      center = placeOf(ball);
    }
    if (cache_.budget().isSpent()) return nullptr;
    const float square = reach * reach;
    float least = roomAround(center) * roomAround(center);
    for (const Near& near : near_) {
      const float apart = ((center - near.center).abs() - near.half).max(0.0F).square().sum();
      least = std::min(least, std::max(apart, square));
      if (apart < square && findMetIn(cache_[near.obstacles], ball)) return &met_;
    }
    free_center_ = center;
    free_radius_ = std::sqrt(least) - 2.0F * kRounding;
    return nullptr;
  }

 private:
  static constexpr double kMaxRadius = 16.0;  ///< Voxels.
  /// Bound of the rounding errors of single precision: a window has at most 48 voxels along an axis.
  static constexpr float kRounding = 1e-4F;

  /// A brick with obstacles, and the box around them in voxels from the corner of the window. Single precision
  /// suffices to skip bricks far from a ball.
  struct Near {
    Eigen::Array3f center;
    Eigen::Array3f half;
    std::uint32_t obstacles;  ///< Number of them.
  };

  bool isMetAtCenter(const Ball& ball);
  void moveTo(const Ball& ball);
  /// The centre of a ball from the corner of the window.
  [[nodiscard]] Eigen::Array3f placeOf(const Ball& ball) const {
    return (ball.center() - corner_).cast<float>();
  }
  /// Whether a ball lies in the one that is known to be free.
  [[nodiscard]] bool isInFree(const Eigen::Array3f& center, float reach) const {
    const float room = free_radius_ - reach;
    return room > 0.0F && (center - free_center_).square().sum() < room * room;
  }
  /// Distance to the faces of the window; negative outside.
  [[nodiscard]] float roomAround(const Eigen::Array3f& center) const {
    return (half_ - (center - middle_).abs()).minCoeff();
  }
  bool findMetIn(const BrickObstacles& obstacles, const Ball& ball);
  const Cell* keep(const std::optional<Cell>& met) {
    has_met_ = met.has_value();
    return has_met_ ? &(met_ = *met) : nullptr;
  }

  ObstacleCache& cache_;
  /// Corner of the window, which has whole bricks.
  Eigen::Vector3d corner_ = Eigen::Vector3d::Zero();
  Eigen::Array3f middle_ = Eigen::Array3f::Zero();  ///< Middle of the window, from its corner.
  Eigen::Array3f half_ = Eigen::Array3f::Constant(-1.0F);  ///< Half the edges of the window.
  std::vector<Near> near_;
  /// Generation of the numbers in near_; other shapes trim the cache.
  std::uint64_t generation_ = 0;
  Cell met_;  ///< The obstacle that the last ball met: the next one often meets it, too.
  bool has_met_ = false;
  Eigen::Array3f free_center_ = Eigen::Array3f::Zero();  ///< Centre of a ball without an obstacle.
  float free_radius_ = 0.0F;
};

}  // namespace cuboid_mapping
