// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/no_return/beam_layouts.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace cuboid_mapping {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

/// Wraps an angle to -pi ... pi.
double wrapAngle(double angle_rad) {
  // Much faster than std::remainder, and exact enough.
  return angle_rad - 2.0 * M_PI * std::floor(angle_rad / (2.0 * M_PI) + 0.5);
}

/// Calls visit(column, index) for the returns of a row that are not near a pole.
template <typename VisitorT>
void visitRow(const BeamGrid& grid, const Layout& layout, std::size_t row, VisitorT visit) {
  for (std::size_t column = 0; column < layout.columns; ++column) {
    const std::size_t index = layout.index(row, column);
    if (!grid.isReturn(index)) continue;
    if (grid.directions[index].head<2>().squaredNorm() < kMinCosine * kMinCosine) {
      continue;
    }
    visit(column, index);
  }
}

/// Median of the azimuth from column to column, over neighbouring returns of a row.
std::optional<double> findMedianStep(const BeamGrid& grid, const Layout& layout) {
  const std::size_t max_gap = std::max<std::size_t>(1, layout.columns / 8);
  std::vector<float> steps;
  for (std::size_t row = 0; row < layout.rows; ++row) {
    std::optional<std::size_t> last;
    std::size_t last_column = 0;
    visitRow(grid, layout, row, [&](std::size_t column, std::size_t index) {
      if (last && column - last_column <= max_gap) {
        const double turn = wrapAngle(grid.azimuths_rad[index] - grid.azimuths_rad[*last]);
        steps.push_back(static_cast<float>(turn / static_cast<double>(column - last_column)));
      }
      last = index;
      last_column = column;
    });
  }
  if (steps.empty()) return std::nullopt;
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return *middle;
}

/// Line of azimuth over column of one row, unwrapped by the median step.
LineFit fitRow(const BeamGrid& grid, const Layout& layout, std::size_t row, double median_step) {
  LineFit line;
  double azimuth = 0.0;
  double last_column = 0.0;
  visitRow(grid, layout, row, [&](std::size_t column, std::size_t index) {
    const double x = static_cast<double>(column);
    const double expected = azimuth + median_step * (x - last_column);
    azimuth = expected + wrapAngle(grid.azimuths_rad[index] - expected);
    last_column = x;
    line.add(x, azimuth);
  });
  return line;
}

/// Sets step and offsets. @return false if no two returns of a row determine them.
bool fitAzimuths(const BeamGrid& grid, SphericalModel& model) {
  const auto median_step = findMedianStep(grid, model.layout);
  if (!median_step) return false;
  std::vector<LineFit> lines(model.layout.rows);
  double sxx = 0.0;
  double sxy = 0.0;
  for (std::size_t row = 0; row < lines.size(); ++row) {
    lines[row] = fitRow(grid, model.layout, row, *median_step);
    sxx += lines[row].sxx();
    sxy += lines[row].sxy();
  }
  if (!(sxx > 0.0)) return false;
  model.azimuth_step_rad = sxy / sxx;

  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  model.azimuths_rad.assign(lines.size(), kUnknown);
  for (std::size_t row = 0; row < lines.size(); ++row) {
    if (lines[row].count() == 0.0) continue;
    const double azimuth = lines[row].offset(model.azimuth_step_rad);
    model.azimuths_rad[row] = azimuth;
    mean += lines[row].count() * Eigen::Vector2d(std::cos(azimuth), std::sin(azimuth));
  }
  for (double& azimuth : model.azimuths_rad) {
    if (std::isnan(azimuth)) azimuth = std::atan2(mean.y(), mean.x());
  }
  return true;
}

/// Results of fitElevations() except the mean elevations.
struct RowStatistics {
  std::vector<std::size_t> known;  ///< Rows with returns.
  double squared_sum = 0.0;  ///< Squared deviations of all returns from the mean of their row.
};

/// Sets the mean elevation of each row with returns.
RowStatistics fitElevations(const BeamGrid& grid, SphericalModel& model) {
  RowStatistics rows;
  model.elevations_rad.assign(model.layout.rows, kUnknown);
  for (std::size_t row = 0; row < model.layout.rows; ++row) {
    double count = 0.0;
    double sum = 0.0;
    double sum_of_squares = 0.0;
    for (std::size_t column = 0; column < model.layout.columns; ++column) {
      const std::size_t index = model.layout.index(row, column);
      if (!grid.isReturn(index)) continue;
      const double elevation = grid.elevations_rad[index];
      count += 1.0;
      sum += elevation;
      sum_of_squares += elevation * elevation;
    }
    if (count == 0.0) continue;
    model.elevations_rad[row] = sum / count;
    rows.squared_sum += std::max(0.0, sum_of_squares - sum * sum / count);
    rows.known.push_back(row);
  }
  return rows;
}

/// Whether the elevations of the known rows rise or fall throughout.
bool isMonotonic(const std::vector<double>& elevations, const std::vector<std::size_t>& known) {
  const bool is_rising = elevations[known.back()] > elevations[known.front()];
  for (std::size_t i = 1; i < known.size(); ++i) {
    if ((elevations[known[i]] > elevations[known[i - 1]]) != is_rising) return false;
  }
  return true;
}

/// Interpolates or extrapolates elevations of rows without returns, where the known rows allow it.
void fillElevations(const std::vector<std::size_t>& known, std::vector<double>& elevations) {
  if (known.size() < 2 || !isMonotonic(elevations, known)) return;
  LineFit line;
  for (const std::size_t row : known) line.add(static_cast<double>(row), elevations[row]);
  const double step = line.slope();
  const double first = static_cast<double>(known.front());
  const double last = static_cast<double>(known.back());
  std::size_t next = 0;  // Index of the first known row at or after this one.
  for (std::size_t row = 0; row < elevations.size(); ++row) {
    const double x = static_cast<double>(row);
    if (x < first) {
      if (first - x <= last - first)
        elevations[row] = elevations[known.front()] - step * (first - x);
    } else if (x > last) {
      if (x - last <= last - first) elevations[row] = elevations[known.back()] + step * (x - last);
    } else if (known[next] == row) {
      ++next;
    } else {
      const double below = static_cast<double>(known[next - 1]);
      const double share = (x - below) / (static_cast<double>(known[next]) - below);
      elevations[row] =
          (1.0 - share) * elevations[known[next - 1]] + share * elevations[known[next]];
    }
    if (std::fabs(elevations[row]) > 0.5 * M_PI) elevations[row] = kUnknown;
  }
}

}  // namespace

std::optional<Eigen::Vector3f> SphericalModel::direction(std::size_t index) const {
  const std::size_t row = index / layout.row_stride % layout.rows;
  const std::size_t column = index / layout.column_stride % layout.columns;
  const double elevation = elevations_rad[row];
  if (std::isnan(elevation)) return std::nullopt;
  const double azimuth = azimuths_rad[row] + azimuth_step_rad * static_cast<double>(column);
  return Eigen::Vector3d(std::cos(elevation) * std::cos(azimuth),
                         std::cos(elevation) * std::sin(azimuth), std::sin(elevation))
      .cast<float>();
}

std::optional<SphericalModel> fitSpherical(const BeamGrid& grid, const Layout& layout,
                                           BeamLayout name) {
  SphericalModel model;
  model.layout = layout;
  model.name = name;
  const RowStatistics rows = fitElevations(grid, model);
  const auto residual_of = [&](double squared_sum) {
    return computeResidual(squared_sum, grid.num_returns, 1 + 2 * rows.known.size());
  };
  // Most wrong layouts end here, before the costly part.
  if (residual_of(rows.squared_sum) > kMaxBeamResidual_rad) return std::nullopt;
  if (!fitAzimuths(grid, model)) return std::nullopt;
  double squared_sum = rows.squared_sum;
  for (const std::size_t row : rows.known) {
    const double cos_elevation = std::cos(model.elevations_rad[row]);
    for (std::size_t column = 0; column < layout.columns; ++column) {
      const std::size_t index = layout.index(row, column);
      if (!grid.isReturn(index)) continue;
      const double azimuth =
          model.azimuths_rad[row] + model.azimuth_step_rad * static_cast<double>(column);
      const double across = cos_elevation * wrapAngle(grid.azimuths_rad[index] - azimuth);
      squared_sum += across * across;
    }
  }
  model.residual_rad = residual_of(squared_sum);
  fillElevations(rows.known, model.elevations_rad);
  return model;
}

}  // namespace cuboid_mapping
