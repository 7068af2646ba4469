// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/fit_query.h"

#include "cuboid_mapping/query/fit_field.h"
#include "cuboid_mapping/query/path_query.h"

#include <algorithm>
#include <cmath>

namespace cuboid_mapping {
namespace {

/// The search, in voxels. A box that fits at neighbouring places also fits between them.
class NearestFitSearch {
 public:
  NearestFitSearch(FitField& field, const Eigen::Vector3d& point, const Eigen::Vector3d& size,
                   double max_distance, Budget& budget)
      : field_(field),
        budget_(budget),
        point_(point),
        half_(0.5 * size),
        best_squared_(max_distance * max_distance) {
    span_ = toVector(field.size());
  }

  std::optional<Eigen::Vector3d> run() {
    const Cell middle = brickOf(toCell(point_ - half_));
    for (std::int32_t ring = 0; isNear(ring) && !budget_.isSpent(); ++ring) {
      searchRing(middle, ring * kBrickEdge);
    }
    return best_;
  }

 private:
  [[nodiscard]] static Cell toCell(const Eigen::Vector3d& point) {
    return {static_cast<std::int32_t>(std::floor(point.x())),
            static_cast<std::int32_t>(std::floor(point.y())),
            static_cast<std::int32_t>(std::floor(point.z()))};
  }

  /// Whether a brick at this distance, in bricks, may hold a better place.
  [[nodiscard]] bool isNear(std::int32_t ring) const {
    const double distance = kBrickEdge * (ring - 1.0) - 1.0;  // 1: the span is rounded up by less.
    return distance <= 0.0 || distance * distance <= best_squared_;
  }

  void searchRing(const Cell& middle, std::int32_t radius) {
    const CellBox ring{middle - Cell{radius, radius, radius},
                       middle + Cell{radius, radius, radius}};
    for (std::int32_t z = ring.min.z; z <= ring.max.z; z += kBrickEdge) {
      for (std::int32_t y = ring.min.y; y <= ring.max.y; y += kBrickEdge) {
        const bool is_side =
            z == ring.min.z || z == ring.max.z || y == ring.min.y || y == ring.max.y;
        const std::int32_t step = is_side || radius == 0 ? kBrickEdge : 2 * radius;
        for (std::int32_t x = ring.min.x; x <= ring.max.x; x += step) {
          if (!budget_.spendAndUnlock()) return;
          searchBrick({x, y, z});
        }
      }
    }
  }

  /// The centres between two places, and as far as the box is smaller than whole voxels.
  [[nodiscard]] Eigen::Vector3d nearestCenter(const Cell& first, const Cell& last) const {
    const Eigen::Vector3d lower = toVector(first) + half_;
    const Eigen::Vector3d upper = (toVector(last) + span_ - half_).cwiseMax(lower);
    return point_.cwiseMax(lower).cwiseMin(upper);
  }

  void searchBrick(const Cell& brick) {
    constexpr std::int32_t kLast = kBrickEdge;  // One more: between this brick and the next.
    const Eigen::Vector3d nearest = nearestCenter(brick, brick + Cell{kLast, kLast, kLast});
    if ((nearest - point_).squaredNorm() > best_squared_) return;
    const BrickMask places = field_.inBrick(brick);
    for (std::int32_t z = 0; z < kBrickEdge; ++z) {
      for (std::uint64_t left = places[static_cast<std::size_t>(z)]; left != 0; left &= left - 1) {
        const int bit = __builtin_ctzll(left);
        tryPlace(brick + Cell{bit & 7, bit >> 3, z});
      }
    }
  }

  /// The place itself, and the ways from it to its neighbours towards the point.
  void tryPlace(const Cell& place) {
    const Eigen::Vector3d nearest = nearestCenter(place, place + Cell{1, 1, 1});
    if ((nearest - point_).squaredNorm() > best_squared_) return;
    int towards = 0;  // Bit per axis on which the point lies beyond the place.
    for (int axis = 0; axis < 3; ++axis) {
      towards |= point_[axis] > place[axis] + span_[axis] - half_[axis] ? 1 << axis : 0;
    }
    for (int axes = 0; axes < 8; ++axes) {
      if ((axes & ~towards) != 0) continue;
      const Cell last = place + Cell{axes & 1, axes >> 1 & 1, axes >> 2};
      const Eigen::Vector3d center = nearestCenter(place, last);
      const double squared = (center - point_).squaredNorm();
      const bool is_better = best_ ? squared < best_squared_ : squared <= best_squared_;
      if (!is_better || !fitsBetween(place, last)) continue;
      best_ = center;
      best_squared_ = squared;
    }
  }

  [[nodiscard]] bool fitsBetween(const Cell& first, const Cell& last) {
    for (std::int32_t z = first.z; z <= last.z; ++z) {
      for (std::int32_t y = first.y; y <= last.y; ++y) {
        for (std::int32_t x = first.x; x <= last.x; ++x) {
          if (!field_.fits({x, y, z})) return false;
        }
      }
    }
    return true;
  }

  FitField& field_;
  Budget& budget_;
  Eigen::Vector3d point_;
  Eigen::Vector3d half_;
  Eigen::Vector3d span_;  ///< Edges of the box in whole voxels.
  double best_squared_;   ///< Squared distance of best_; at first of the greatest distance.
  std::optional<Eigen::Vector3d> best_;
};

}  // namespace

Answer<FitPlace> findNearestFit(const CuboidMap& map, const Eigen::Vector3d& point_map,
                                const Eigen::Vector3d& size_m, UnknownPolicy policy,
                                double max_distance_m, Budget& budget) {
  const Grid& grid = map.grid();
  const auto size = grid.toSizeInCells(size_m);
  const bool is_valid = size && std::isfinite(max_distance_m) && max_distance_m >= 0.0 &&
                        grid.toCellBox(boxAround(
                            point_map, size_m + Eigen::Vector3d::Constant(2.0 * max_distance_m)));
  if (!is_valid) {
    return Answer<FitPlace>::invalid(
        "point, size and max_distance must be finite and within the range of the grid, with edges "
        "> "
        "0 and max_distance >= 0");
  }
  if (policy == UnknownPolicy::kObstacle) {  // Nothing fits beyond the known voxels.
    const auto bounds = map.bounds();
    if (!bounds) return AnswerStatus::kNotFound;
    const Eigen::Vector3d point = grid.toCellUnits(point_map);
    const Eigen::Vector3d farthest = (point - toVector(bounds->min))
                                         .cwiseAbs()
                                         .cwiseMax((point - toVector(bounds->max)).cwiseAbs());
    max_distance_m = std::min(max_distance_m, farthest.norm() * grid.resolution());
  }
  const Obstacles obstacles(map, policy, budget);
  FitField field(obstacles, *size);
  const auto found = NearestFitSearch(field, grid.toCellUnits(point_map), grid.toCellUnits(size_m),
                                      max_distance_m / grid.resolution(), budget)
                         .run();
  if (budget.isSpent()) return AnswerStatus::kBudgetSpent;
  if (!found) return AnswerStatus::kNotFound;
  const Eigen::Vector3d center_map = grid.toMetres(*found);
  return FitPlace{center_map, (center_map - point_map).norm()};
}

}  // namespace cuboid_mapping
