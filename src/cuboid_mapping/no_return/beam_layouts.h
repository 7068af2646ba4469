// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Internal to no_return_beams.cpp: shared parts of its layouts, and the spherical layout.

#include "cuboid_mapping/scan/no_return_beams.h"

#include <Eigen/Core>

#include <cstddef>
#include <optional>
#include <vector>

namespace cuboid_mapping {

/// Cosine of 80 degrees: nearer to the poles of a frame its angles are uncertain.
constexpr float kMinCosine = 0.17F;

/// Rows and columns of a cloud, or swapped.
struct Layout {
  std::size_t rows;
  std::size_t columns;
  std::size_t row_stride;
  std::size_t column_stride;

  [[nodiscard]] std::size_t index(std::size_t row, std::size_t column) const {
    return row * row_stride + column * column_stride;
  }
};

/// Directions of the beams of a cloud, if known.
struct BeamGrid {
  std::vector<Eigen::Vector3f> directions;  ///< Unit vectors; zero for no return.
  std::vector<float> azimuths_rad;
  std::vector<float> elevations_rad;
  std::size_t num_returns = 0;

  [[nodiscard]] bool isReturn(std::size_t index) const { return !directions[index].isZero(0.0F); }
};

/// Least-squares line y = offset + slope * x, from sums.
class LineFit {
 public:
  void add(double x, double y) {
    count_ += 1.0;
    sum_x_ += x;
    sum_y_ += y;
    sum_xx_ += x * x;
    sum_xy_ += x * y;
  }
  [[nodiscard]] double count() const { return count_; }
  /// Sums about the means; those of several lines with one slope add up.
  [[nodiscard]] double sxx() const { return count_ > 0 ? sum_xx_ - sum_x_ * sum_x_ / count_ : 0.0; }
  [[nodiscard]] double sxy() const { return count_ > 0 ? sum_xy_ - sum_x_ * sum_y_ / count_ : 0.0; }
  [[nodiscard]] double slope() const { return sxy() / sxx(); }
  [[nodiscard]] double offset(double slope) const { return (sum_y_ - slope * sum_x_) / count_; }

 private:
  double count_ = 0.0;
  double sum_x_ = 0.0;
  double sum_y_ = 0.0;
  double sum_xx_ = 0.0;
  double sum_xy_ = 0.0;
};

/// RMS angle of beams with two measured angles each, as for a model with unlimited data; infinite
/// when half of the measurements or more went into the parameters.
[[nodiscard]] double computeResidual(double squared_sum, std::size_t num_returns,
                                     std::size_t num_parameters);

/// A lidar that turns about z.
struct SphericalModel {
  Layout layout;
  BeamLayout name;
  double azimuth_step_rad = 0.0;       ///< Azimuth step from column to column.
  std::vector<double> azimuths_rad;    ///< Azimuths of column 0, by row.
  std::vector<double> elevations_rad;  ///< Elevations by row; NaN if unknown.
  double residual_rad = 0.0;

  /// Direction of a point's beam; nothing if the elevation of its row is unknown.
  [[nodiscard]] std::optional<Eigen::Vector3f> direction(std::size_t index) const;
};

/// Fits a spherical layout. @return Nothing if its elevations alone fit worse than
/// kMaxBeamResidual_rad, or the returns do not determine the azimuths.
[[nodiscard]] std::optional<SphericalModel> fitSpherical(const BeamGrid& grid, const Layout& layout,
                                                         BeamLayout name);

}  // namespace cuboid_mapping
