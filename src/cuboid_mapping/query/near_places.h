// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/query/fit_field.h"

#include <optional>
#include <vector>

namespace cuboid_mapping {

/// A position near a point at which a box fits, in voxels.
struct NearPlace {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  ///< Centre of the box.
  double squared = 0.0;  ///< Squared distance of the centre from the point.
};

/// The positions near a point at which a box fits. A box that fits at neighbouring places also fits between them.
class NearPlaces {
 public:
  /// @param field  Places of the box. Must outlive this object. @param point, size  In voxels.
  /// @param allowed  Places outside are left out.
  NearPlaces(FitField& field, const Eigen::Vector3d& point, const Eigen::Vector3d& size,
             const CellBox& allowed);

  /// The nearest position; nothing if there is none, or if the budget of the field is spent.
  [[nodiscard]] std::optional<NearPlace> findNearest(double max_distance);
  /// The nearest positions at each place, and between it and its neighbours, the nearest first. Some of them if the
  /// budget is spent.
  [[nodiscard]] std::vector<NearPlace> findAll(double max_distance);
  /// Distance beyond which there is no allowed position.
  [[nodiscard]] double farthest() const;
  /// The nearest position in a box of places at all of which the box fits.
  [[nodiscard]] NearPlace nearestIn(const CellBox& places) const;
  /// One of these places that covers the box at a position in it.
  [[nodiscard]] Cell placeAt(const Eigen::Vector3d& center, const CellBox& places) const;

 private:
  enum class Wanted : unsigned char { kNearest, kAll };

  void search(double max_distance, Wanted wanted);
  void keep(const NearPlace& place, Wanted wanted);
  [[nodiscard]] bool isNear(std::int32_t ring) const;
  void searchRing(const Cell& middle, std::int32_t radius, Wanted wanted);
  void searchBrick(const Cell& brick, Wanted wanted);
  void findAt(const Cell& place, Wanted wanted);
  [[nodiscard]] bool fitsBetween(const CellBox& places);

  FitField& field_;
  Eigen::Vector3d point_;
  Eigen::Vector3d half_;
  Eigen::Vector3d span_;  ///< Edges of the box in whole voxels.
  CellBox allowed_;
  double max_squared_ = 0.0;  ///< Squared distance of the nearest place; at first the greatest one.
  std::vector<NearPlace> found_;
};

}  // namespace cuboid_mapping
