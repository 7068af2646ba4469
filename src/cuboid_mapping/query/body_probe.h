// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/query/near_obstacles.h"
#include "cuboid_mapping/query/pose_query.h"

#include <optional>

namespace cuboid_mapping {

/// Motion of a body from its middle pose to either end.
struct Sway {
  Eigen::Vector3d shift_body = Eigen::Vector3d::Zero();  ///< Half of the straight motion, metres.
  Eigen::Vector3d turn_body =
      Eigen::Vector3d::Zero();  ///< Axis of the turn; its length is half of the angle [rad].
};

/// Looks up a body in a map at one pose after the other. The probe keeps the bricks that it has read, also if
/// the map changes.
class BodyProbe {
 public:
  /// @param body, budget  Must outlive this object. @pre findFault(body, map.grid()) is empty.
  /// @param region  Voxels outside of it are obstacles. @param margin_body  Enlarges all parts, on both sides along
  /// each axis, metres.
  BodyProbe(const CuboidMap& map, const Body& body, UnknownPolicy policy, Budget& budget,
            const std::optional<CellBox>& region = std::nullopt,
            const Eigen::Vector3d& margin_body = Eigen::Vector3d::Zero())
      : body_(body),
        margin_body_(margin_body.cwiseMin(kMostMargin * map.grid().resolution())),
        grid_(map.grid()),
        cache_(map, policy, budget),
        near_(cache_),
        region_(region) {}
  // near_ refers to cache_.
  BodyProbe(const BodyProbe&) = delete;
  BodyProbe& operator=(const BodyProbe&) = delete;

  /// An obstacle that the body meets; perhaps nothing if the budget is spent. @pre isPose(T_map_body, rangeOf(body,
  /// grid)).
  [[nodiscard]] std::optional<PoseContact> findContact(const Eigen::Isometry3d& T_map_body);
  /// As above, for all positions within the sway. Conservative: it enlarges the parts.
  [[nodiscard]] std::optional<PoseContact> findContact(const Eigen::Isometry3d& T_map_body,
                                                       const Sway& sway);

  [[nodiscard]] Budget& budget() const { return cache_.budget(); }
  [[nodiscard]] const Body& body() const { return body_; }
  [[nodiscard]] const Grid& grid() const { return grid_; }
  /// Number of poses that were looked up.
  [[nodiscard]] std::size_t numPoses() const { return num_poses_; }

 private:
  /// In voxels: no body with such a margin fits, and no coordinate of it overflows.
  static constexpr double kMostMargin = Grid::kMaxCell / 4.0;

  template <typename GrowthT>
  std::optional<PoseContact> find(const Eigen::Isometry3d& T_map_body, const GrowthT& growth);
  template <typename ShapeT>
  const Cell* findMet(const ShapeT& shape);
  const Cell* keep(const Cell& met) { return &(met_ = met); }

  const Body& body_;
  Eigen::Vector3d margin_body_;
  Grid grid_;
  ObstacleCache cache_;
  NearObstacles near_;
  Cell met_;
  std::optional<CellBox> region_;
  std::size_t num_poses_ = 0;
};

/// One of the 8 corners of a box, frame of the body.
[[nodiscard]] inline Eigen::Vector3d cornerOf(const BodyBox& box, int corner) {
  const Eigen::Vector3d sign((corner & 1) - 0.5, (corner >> 1 & 1) - 0.5, (corner >> 2 & 1) - 0.5);
  return box.T_body_box * Eigen::Vector3d(sign.cwiseProduct(box.size_m));
}

/// Maximum distance of a body from the origin of the map, metres.
[[nodiscard]] double rangeOf(const Body& body, const Grid& grid);
/// Whether a pose is finite, a rotation (to 1e-6), and within a range. @param range_m  As rangeOf() says.
[[nodiscard]] bool isPose(const Eigen::Isometry3d& pose, double range_m);

}  // namespace cuboid_mapping
