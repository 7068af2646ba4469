// SPDX-License-Identifier: BSD-3-Clause
// Conversions between numpy arrays and the types of the library. All functions need the GIL.
#pragma once

#include "cuboid_mapping/geometry/grid.h"
#include "cuboid_mapping/occupancy/sensor_model.h"
#include "cuboid_mapping/query/unknown_policy.h"
#include "cuboid_mapping/rtree/traversal.h"

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <Eigen/Geometry>

#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace cuboid_map_python {

namespace py = pybind11;

/// Exception of the functions below, Python's ValueError. Its text names the argument, and the requirement.
using Error = std::invalid_argument;

/// numpy would drop a mask and imaginary parts, and parse texts. @throws Error  for a masked array, and for values that
/// are no real numbers.
void requireRealNumbers(const py::handle& values);

/// Contiguous array of real numbers, or values that numpy converts to these. See requireRealNumbers().
template <typename T>
class Numbers : public py::array_t<T, py::array::c_style | py::array::forcecast> {
 public:
  using Base = py::array_t<T, py::array::c_style | py::array::forcecast>;
  using Base::Base;
  Numbers() = default;
  explicit Numbers(Base&& base) : Base(std::move(base)) {}
  /// For py::cast(). @throws Error  as requireRealNumbers().
  explicit Numbers(const py::object& values) : Base(checked(values)) {}

 private:
  static const py::object& checked(const py::object& values) {
    requireRealNumbers(values);
    return values;
  }
};
using Doubles = Numbers<double>;
using Floats = Numbers<float>;

/// Name of a file: str, bytes or os.PathLike, as open() of Python takes it.
struct FileName {
  std::string text;
};

/// @param name  Name of the argument. @throws Error  unless the array is (n, 3), or empty.
[[nodiscard]] std::vector<Eigen::Vector3d> toPoints(const Doubles& array, const char* name);
[[nodiscard]] std::vector<Eigen::Vector3f> toPoints(const Floats& array, const char* name);

/// @throws Error unless the array is (3,).
[[nodiscard]] Eigen::Vector3d toVector(const Doubles& array, const char* name);

/// A box in metres of an array (6,): min x, y, z, max x, y, z; as voxels of a grid.
/// @throws Error unless max > min, and all is finite and in the range of the grid.
[[nodiscard]] cuboid_mapping::CellBox toCellBox(const cuboid_mapping::Grid& grid,
                                                const Doubles& array, const char* name);
/// As above, for an array (n, 6); an error names the row.
[[nodiscard]] std::vector<cuboid_mapping::CellBox> toCellBoxes(const cuboid_mapping::Grid& grid,
                                                               const Doubles& array,
                                                               const char* name);

/// A 4 x 4 matrix of a rotation and a translation. @throws Error  for any other matrix.
[[nodiscard]] Eigen::Isometry3d toPose(const Doubles& array, const char* name);

/// "free", "occupied", "unknown", or the numbers of Occupancy.
[[nodiscard]] cuboid_mapping::Occupancy toOccupancy(const py::object& value);
/// "all", "free" or "occupied".
[[nodiscard]] cuboid_mapping::CuboidFilter toFilter(const std::string& text);
/// "obstacle" or "free".
[[nodiscard]] cuboid_mapping::UnknownPolicy toUnknownPolicy(const std::string& text);

/// An array that keeps a vector's memory. @pre the shape has as many elements.
template <typename T>
[[nodiscard]] py::array_t<T> toArray(std::vector<T>&& values, std::vector<py::ssize_t> shape) {
  auto kept = std::make_unique<std::vector<T>>(std::move(values));
  const T* data = kept->data();
  const py::capsule owner(kept.release(),
                          [](void* vector) { delete static_cast<std::vector<T>*>(vector); });
  return py::array_t<T>(std::move(shape), data, owner);
}
/// (n,)
template <typename T>
[[nodiscard]] py::array_t<T> toArray(std::vector<T>&& values) {
  const auto count = static_cast<py::ssize_t>(values.size());
  return toArray(std::move(values), {count});
}
/// (n, columns)
template <typename T>
[[nodiscard]] py::array_t<T> toRows(std::vector<T>&& values, py::ssize_t columns) {
  const auto count = static_cast<py::ssize_t>(values.size()) / columns;
  return toArray(std::move(values), {count, columns});
}

/// Rows of numbers.
inline void append(std::vector<double>& rows, const Eigen::Vector3d& point) {
  rows.insert(rows.end(), point.data(), point.data() + 3);
}
inline void append(std::vector<double>& rows, const cuboid_mapping::MetricBox& box) {
  append(rows, box.min_m);
  append(rows, box.max_m);
}

/// Appends the 16 numbers of a matrix (4, 4).
inline void append(std::vector<double>& rows, const Eigen::Isometry3d& pose) {
  const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> matrix = pose.matrix();
  rows.insert(rows.end(), matrix.data(), matrix.data() + matrix.size());
}

/// A named tuple of cuboid_map.results.
template <typename... FieldsT>
[[nodiscard]] py::object makeResult(const char* type, FieldsT&&... fields) {
  return py::module::import("cuboid_map.results").attr(type)(std::forward<FieldsT>(fields)...);
}

}  // namespace cuboid_map_python

namespace pybind11::detail {

/// Conversion of arguments to Numbers.
template <typename NumbersT>
struct NumbersCaster {
  PYBIND11_TYPE_CASTER(NumbersT, handle_type_name<typename NumbersT::Base>::name);

  bool load(handle source, bool convert) {
    if (!convert && !NumbersT::Base::check_(source)) return false;
    cuboid_map_python::requireRealNumbers(source);
    value = NumbersT(NumbersT::Base::ensure(source));
    return static_cast<bool>(value);
  }
  static handle cast(const NumbersT& source, return_value_policy /*policy*/, handle /*parent*/) {
    return source.inc_ref();
  }
};

template <>
struct type_caster<cuboid_map_python::FileName> {
  PYBIND11_TYPE_CASTER(cuboid_map_python::FileName, make_caster<std::string>::name);

  bool load(handle source, bool /*convert*/) {
    PyObject* converted = nullptr;
    if (PyUnicode_FSConverter(source.ptr(), &converted) == 0) throw error_already_set();
    value.text = reinterpret_steal<bytes>(converted);
    return true;
  }
};

template <>
struct type_caster<cuboid_map_python::Doubles> : NumbersCaster<cuboid_map_python::Doubles> {};
template <>
struct type_caster<cuboid_map_python::Floats> : NumbersCaster<cuboid_map_python::Floats> {};

}  // namespace pybind11::detail
