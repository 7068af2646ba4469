// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/scan/no_return_beams.h"

#include "cuboid_mapping/no_return/beam_layouts.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <optional>
#include <variant>

namespace cuboid_mapping {
namespace {

constexpr std::size_t kMinPoints = 50;
constexpr double kMinPointShare = 0.05;
constexpr double kMinSpanShare = 0.25;

BeamGrid toBeamGrid(const std::vector<Eigen::Vector3f>& points) {
  BeamGrid grid;
  grid.directions.assign(points.size(), Eigen::Vector3f::Zero());
  grid.azimuths_rad.resize(points.size());
  grid.elevations_rad.resize(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    // In double no square of a float32 overflows or vanishes.
    const double range_m = points[i].cast<double>().norm();
    if (!std::isfinite(range_m) || range_m == 0.0) continue;
    const Eigen::Vector3f direction = (points[i].cast<double>() / range_m).cast<float>();
    grid.directions[i] = direction;
    grid.azimuths_rad[i] = std::atan2(direction.y(), direction.x());
    grid.elevations_rad[i] = std::atan2(direction.z(), direction.head<2>().norm());
    ++grid.num_returns;
  }
  return grid;
}

/// Whether returns lie in columns far enough apart to determine the columns between and beside them.
bool isSpanned(const BeamGrid& grid, const Layout& layout) {
  std::size_t first = layout.columns;
  std::size_t last = 0;
  for (std::size_t column = 0; column < layout.columns; ++column) {
    for (std::size_t row = 0; row < layout.rows; ++row) {
      if (!grid.isReturn(layout.index(row, column))) continue;
      first = std::min(first, column);
      last = column;
      break;
    }
  }
  return static_cast<double>(last) - static_cast<double>(first) + 1.0 >=
         kMinSpanShare * static_cast<double>(layout.columns);
}

/// A camera that measures depth.
struct PinholeModel {
  std::size_t columns;
  BeamLayout name;
  std::array<int, 3> axes;  ///< Axes: forward, across (along a row), down or up.
  double column_step = 0.0;
  double column_offset = 0.0;
  double row_step = 0.0;
  double row_offset = 0.0;
  double residual_rad = 0.0;

  [[nodiscard]] std::optional<Eigen::Vector3f> direction(std::size_t index) const {
    const std::size_t row = index / columns;
    Eigen::Vector3d direction;
    direction[axes[0]] = 1.0;
    direction[axes[1]] = column_offset + column_step * static_cast<double>(index % columns);
    direction[axes[2]] = row_offset + row_step * static_cast<double>(row);
    return direction.normalized().cast<float>();
  }
};

std::optional<PinholeModel> fitPinhole(const BeamGrid& grid, std::size_t columns,
                                       const std::array<int, 3>& axes, BeamLayout name) {
  PinholeModel model;
  model.columns = columns;
  model.name = name;
  model.axes = axes;
  LineFit across;
  LineFit down;
  for (std::size_t index = 0; index < grid.directions.size(); ++index) {
    if (!grid.isReturn(index)) continue;
    const Eigen::Vector3d direction = grid.directions[index].cast<double>();
    if (direction[axes[0]] < kMinCosine) return std::nullopt;  // Beside or behind: no image.
    const std::size_t row = index / columns;
    across.add(static_cast<double>(index % columns), direction[axes[1]] / direction[axes[0]]);
    down.add(static_cast<double>(row), direction[axes[2]] / direction[axes[0]]);
  }
  if (!(across.sxx() > 0.0 && down.sxx() > 0.0)) return std::nullopt;
  model.column_step = across.slope();
  model.column_offset = across.offset(model.column_step);
  model.row_step = down.slope();
  model.row_offset = down.offset(model.row_step);

  double squared_sum = 0.0;
  for (std::size_t index = 0; index < grid.directions.size(); ++index) {
    if (!grid.isReturn(index)) continue;
    const double chord = (grid.directions[index] - *model.direction(index)).cast<double>().norm();
    squared_sum += chord * chord;
  }
  model.residual_rad = computeResidual(squared_sum, grid.num_returns, 4);
  return model;
}

using Model = std::variant<SphericalModel, PinholeModel>;

bool isBetter(const Model& a, const Model& b) {
  const auto residual_of = [](const Model& model) {
    return std::visit([](const auto& m) { return m.residual_rad; }, model);
  };
  return residual_of(a) < residual_of(b);
}

/// All models that fit well enough.
std::vector<Model> fitModels(const BeamGrid& grid, std::size_t width, std::size_t height) {
  const Layout rows{height, width, width, 1};
  const Layout columns{width, height, 1, width};
  const bool spans_columns = isSpanned(grid, rows);
  const bool spans_rows = isSpanned(grid, columns);
  std::vector<Model> models;
  const auto add_if_good = [&models](const auto& model) {
    if (model && model->residual_rad <= kMaxBeamResidual_rad) models.emplace_back(*model);
  };
  if (spans_columns) add_if_good(fitSpherical(grid, rows, BeamLayout::kSphericalRows));
  if (spans_rows) add_if_good(fitSpherical(grid, columns, BeamLayout::kSphericalColumns));
  if (spans_columns && spans_rows) {
    add_if_good(fitPinhole(grid, width, {2, 0, 1}, BeamLayout::kPinholeOptical));
    add_if_good(fitPinhole(grid, width, {0, 1, 2}, BeamLayout::kPinholeBody));
  }
  return models;
}

template <typename ModelT>
void collectBeams(const BeamGrid& grid, const ModelT& model, NoReturnBeams& result) {
  result.layout = model.name;
  result.residual_rad = model.residual_rad;
  for (std::size_t index = 0; index < grid.directions.size(); ++index) {
    if (grid.isReturn(index)) continue;
    if (const auto direction = model.direction(index)) {
      result.beams.push_back({index, *direction});
    }
  }
}

}  // namespace

double computeResidual(double squared_sum, std::size_t num_returns, std::size_t num_parameters) {
  const double num_measured = 2.0 * static_cast<double>(num_returns);
  const double freedom = num_measured - static_cast<double>(num_parameters);
  if (freedom <= 0.5 * num_measured) return std::numeric_limits<double>::infinity();
  return std::sqrt(2.0 * squared_sum / freedom);
}

NoReturnBeams estimateNoReturnBeams(const std::vector<Eigen::Vector3f>& points_sensor,
                                    std::size_t width, std::size_t height) {
  assert(points_sensor.size() == width * height);
  NoReturnBeams result;
  const BeamGrid grid = toBeamGrid(points_sensor);
  const std::size_t num_no_returns = points_sensor.size() - grid.num_returns;
  const double enough =
      std::max<double>(kMinPoints, kMinPointShare * static_cast<double>(points_sensor.size()));
  if (num_no_returns != 0 && static_cast<double>(grid.num_returns) >= enough) {
    const std::vector<Model> models = fitModels(grid, width, height);
    const auto best = std::min_element(models.begin(), models.end(), isBetter);
    if (best != models.end()) {
      std::visit([&](const auto& model) { collectBeams(grid, model, result); }, *best);
    }
  }
  result.num_skipped = num_no_returns - result.beams.size();
  return result;
}

}  // namespace cuboid_mapping
