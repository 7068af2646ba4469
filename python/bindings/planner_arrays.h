// SPDX-License-Identifier: BSD-3-Clause
// Helpers of the bindings of planner queries.
#pragma once

#include "arrays.h"
#include "cuboid_mapping/geometry/grid.h"
#include "cuboid_mapping/query/answer.h"
#include "cuboid_mapping/query/budget.h"

#include <Eigen/Core>

#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace cuboid_map_python {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
const Eigen::Vector3d kNowhere = Eigen::Vector3d::Constant(NAN);

/// Name of an element, such as "paths[3]".
inline std::string element(const char* name, std::size_t index) {
  return std::string(name) + "[" + std::to_string(index) + "]";
}

/// An answer whose question was right. @throws Error  with the fault of an invalid question.
template <typename T>
cuboid_mapping::Answer<T> valid(cuboid_mapping::Answer<T> answer, const std::string& name) {
  if (!answer.fault.empty()) throw Error(name + ": " + answer.fault);
  return answer;
}

/// As valid(), for a query of places where a robot fits. It has no limit of its own: the search ends early only if the
/// robot is too large for it.
template <typename T>
cuboid_mapping::Answer<T> complete(cuboid_mapping::Answer<T> answer, const std::string& name) {
  if (answer.status == cuboid_mapping::AnswerStatus::kBudgetSpent) {
    throw Error(name + ": size has too many voxels: choose a smaller one, or a coarser map");
  }
  return valid(std::move(answer), name);
}

/// The budget of a query, which ends with the exception that a handler of Python's signals raises, such as
/// KeyboardInterrupt. @throws Error  unless the limit is >= 0; infinity is none.
inline cuboid_mapping::Budget toBudget(double time_limit_s = kInfinity) {
  if (!(time_limit_s >= 0.0)) throw Error("time_limit must be >= 0, in seconds");
  const auto handle_signals = [] {
    const py::gil_scoped_acquire gil;  // No thread waits for a map's lock with it.
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
  };
  constexpr double kPeriod_s = 0.1;
  return cuboid_mapping::Budget(cuboid_mapping::QueryLimits{time_limit_s},
                                {handle_signals, kPeriod_s});
}

/// cuboid_map.results.CorridorEnd of a search for a way, with the numbers of the service find_corridor.
template <typename WayT>
py::object toCorridorEnd(const cuboid_mapping::Answer<WayT>& answer) {
  const int number = answer.isFound()      ? 1
                     : answer.isNotFound() ? 2 + static_cast<int>(answer.value.blocked)
                                           : 5;
  return py::module::import("cuboid_map.results").attr("CorridorEnd")(number);
}

/// (3,), metres: centre of a voxel; NaN without one.
inline py::object toPointOf(const cuboid_mapping::Grid& grid,
                            const std::optional<cuboid_mapping::Cell>& cell) {
  std::vector<double> point;
  append(point, cell ? grid.centerOf(cuboid_mapping::CellBox::ofCell(*cell)) : kNowhere);
  return toArray(std::move(point));
}

/// @throws Error
inline void require(bool is_right, const std::string& text) {
  if (!is_right) throw Error(text);
}

}  // namespace cuboid_map_python
