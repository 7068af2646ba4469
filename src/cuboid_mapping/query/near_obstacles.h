// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/query/body_shapes.h"
#include "cuboid_mapping/query/obstacle_cache.h"

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

/// The bricks with obstacles around a ball, kept for the balls after it: those of an arm lie close together, and meet
/// few of these bricks.
class NearObstacles {
 public:
  /// @param cache  Must outlive this object.
  explicit NearObstacles(ObstacleCache& cache) : cache_(cache) {}

  /// Whether the bricks around a ball are few enough to keep.
  [[nodiscard]] static bool isSmall(const Ball& ball) { return ball.radius() <= kMaxRadius; }
  /// An obstacle that a ball meets, valid until the next call; null: none, or the budget is spent. @pre isSmall(ball).
  [[nodiscard]] const Cell* findMet(const Ball& ball) {
    if (has_met_ && ball.meets(Cube::of(met_, 1.0))) return &met_;
    has_met_ = false;
    const float reach = static_cast<float>(ball.radius()) + kRounding;
    Eigen::Vector3f center = placeOf(ball);
    if (((center - middle_).cwiseAbs() - half_).maxCoeff() > -reach) {
      moveTo(ball);
      center = placeOf(ball);
    }
    if (cache_.budget().isSpent()) return nullptr;
    for (const Near& near : near_) {
      const Eigen::Array3f away = (center - near.center).cwiseAbs() - near.half;
      if (away.max(0.0F).square().sum() >= reach * reach) continue;
      if (findMetIn(near.obstacles, ball)) return &met_;
    }
    return nullptr;
  }

 private:
  static constexpr double kMaxRadius = 16.0;  ///< Voxels.
  /// More than what single precision rounds: a window has at most 48 voxels along an axis.
  static constexpr float kRounding = 1e-4F;

  /// A brick with obstacles, and the box around them in voxels from the corner of the window: single precision decides
  /// which bricks a ball is far from.
  struct Near {
    Eigen::Vector3f center;
    Eigen::Vector3f half;
    BrickObstacles obstacles;
  };

  void moveTo(const Ball& ball);
  /// The centre of a ball from the corner of the window.
  [[nodiscard]] Eigen::Vector3f placeOf(const Ball& ball) const {
    return (ball.center() - corner_).cast<float>();
  }
  bool findMetIn(const BrickObstacles& obstacles, const Ball& ball);

  ObstacleCache& cache_;
  Eigen::Vector3d corner_ = Eigen::Vector3d::Zero();         ///< Of the window: whole bricks.
  Eigen::Vector3f middle_ = Eigen::Vector3f::Zero();         ///< Of the window, from its corner.
  Eigen::Vector3f half_ = Eigen::Vector3f::Constant(-1.0F);  ///< Half the edges of the window.
  std::vector<Near> near_;
  Cell met_;  ///< The obstacle that the last ball met: the next one often meets it, too.
  bool has_met_ = false;
};

}  // namespace cuboid_mapping
