// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <vector>

namespace cuboid_mapping {

/// Layout of the beams of an organized cloud.
enum class BeamLayout : unsigned char {
  kUnknown,           ///< None of the others, too few points to tell, or no beam to estimate.
  kSphericalRows,     ///< A lidar that turns about z; a row has the points of one laser.
  kSphericalColumns,  ///< The same with rows and columns swapped.
  kPinholeOptical,    ///< An image: x right, y down, z forward.
  kPinholeBody        ///< An image: x forward, y left, z up.
};

/// Directions of the beams without return of an organized cloud.
struct NoReturnBeams {
  /// One beam.
  struct Beam {
    std::size_t index;          ///< Index of the cloud's point.
    Eigen::Vector3f direction;  ///< Unit vector, sensor frame.
  };

  BeamLayout layout = BeamLayout::kUnknown;  ///< The layout that fits best.
  double residual_rad = 0.0;    ///< RMS angle between the layout's beams and the points.
  std::vector<Beam> beams;      ///< Beams in the order of the cloud.
  std::size_t num_skipped = 0;  ///< Beams without return whose direction remains unknown.
};

/// Maximum residual of a layout: 1 degree.
constexpr double kMaxBeamResidual_rad = 0.017453292519943295;

/// Estimates the directions of beams without return from the beams that did return.
///
/// Each layout is fitted to the valid points by least squares, and the best is taken:
///   - spherical: azimuth linear in the column, with the same slope for all rows, turning either
///     way, from any start; each row has its own azimuth offset and its own mean elevation, as the
///     lasers of lidars are not equally spaced;
///   - pinhole: x / z linear in the column and y / z linear in the row.
///
/// All beams without return are skipped when
///   - fewer than 50 points, or 5 % of all, are valid, or they span less than a quarter of the
///     columns (of an image also: of the rows), or there are not more than two on average in the
///     rows that have any;
///   - the RMS angle between the fit and the points, per degree of freedom, exceeds
///     kMaxBeamResidual_rad. Such clouds are not organized by beams, or not in the
///     sensor's frame.
/// A row of a spherical layout without any valid point is interpolated between its neighbours, or
/// extrapolated by the mean step between rows, as far as the known rows span. Its beams are skipped
/// farther out, and where the known elevations neither rise nor fall throughout.
///
/// @param points_sensor  Row by row, in metres, sensor frame. Not finite or (0, 0, 0): no return.
/// @pre points_sensor.size() == width * height.
/// @complexity O(width * height).
[[nodiscard]] NoReturnBeams estimateNoReturnBeams(const std::vector<Eigen::Vector3f>& points_sensor,
                                                  std::size_t width, std::size_t height);

}  // namespace cuboid_mapping
