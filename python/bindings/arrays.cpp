// SPDX-License-Identifier: BSD-3-Clause
#include "arrays.h"

#include <sstream>

namespace cuboid_map_python {
namespace {

using cuboid_mapping::CellBox;
using cuboid_mapping::CuboidFilter;
using cuboid_mapping::Grid;
using cuboid_mapping::MetricBox;
using cuboid_mapping::Occupancy;
using cuboid_mapping::UnknownPolicy;

std::string shapeOf(const py::array& array) {
  return py::str(array.attr("shape")).cast<std::string>();
}

void expectColumns(const py::array& array, py::ssize_t columns, const char* name) {
  if (array.size() == 0 || (array.ndim() == 2 && array.shape(1) == columns)) return;
  throw Error(std::string(name) + " must have the shape (n, " + std::to_string(columns) +
              "); it has " + shapeOf(array));
}

void expectNumbers(const py::array& array, py::ssize_t count, const char* name) {
  if (array.ndim() == 1 && array.shape(0) == count) return;
  throw Error(std::string(name) + " must have the shape (" + std::to_string(count) + ",); it has " +
              shapeOf(array));
}

template <typename T, typename ArrayT>
std::vector<Eigen::Matrix<T, 3, 1>> copyPoints(const ArrayT& array, const char* name) {
  expectColumns(array, 3, name);
  std::vector<Eigen::Matrix<T, 3, 1>> points(static_cast<std::size_t>(array.size() / 3));
  const T* data = array.data();
  for (std::size_t i = 0; i < points.size(); ++i) {
    points[i] = Eigen::Map<const Eigen::Matrix<T, 3, 1>>(data + 3 * i);
  }
  return points;
}

CellBox boxOfRow(const Grid& grid, const double* data, const std::string& name) {
  const MetricBox box{Eigen::Map<const Eigen::Vector3d>(data),
                      Eigen::Map<const Eigen::Vector3d>(data + 3)};
  if (const auto cells = grid.toCellBox(box)) return *cells;
  std::ostringstream text;
  text << name << " is [" << box.min_m.transpose() << " " << box.max_m.transpose()
       << "]: it must be min x, y, z, max x, y, z in metres, with max > min, finite, and within "
       << Grid::kMaxCell * grid.resolution() << " m";
  throw Error(text.str());
}

}  // namespace

void requireRealNumbers(const py::handle& values) {
  const py::object masked = py::module::import("numpy.ma").attr("MaskedArray");
  const auto refuse_mask = [&masked](const py::handle& value) {
    if (!py::isinstance(value, masked)) return;
    throw Error("an argument is a masked array: pass the values that are not masked, or fill it");
  };
  refuse_mask(values);
  if (py::isinstance<py::list>(values) || py::isinstance<py::tuple>(values)) {
    for (const py::handle row : values) refuse_mask(row);
  }
  const auto array = py::array::ensure(values);
  if (!array) return;
  const char kind = array.dtype().kind();
  if (std::string("biuf").find(kind) != std::string::npos) return;
  throw Error("an argument has the dtype " + py::str(array.dtype()).cast<std::string>() +
              ": its values must be real numbers");
}

std::vector<Eigen::Vector3d> toPoints(const Doubles& array, const char* name) {
  return copyPoints<double>(array, name);
}

std::vector<Eigen::Vector3f> toPoints(const Floats& array, const char* name) {
  return copyPoints<float>(array, name);
}

Eigen::Vector3d toVector(const Doubles& array, const char* name) {
  expectNumbers(array, 3, name);
  return Eigen::Map<const Eigen::Vector3d>(array.data());
}

CellBox toCellBox(const Grid& grid, const Doubles& array, const char* name) {
  expectNumbers(array, 6, name);
  return boxOfRow(grid, array.data(), name);
}

std::vector<CellBox> toCellBoxes(const Grid& grid, const Doubles& array, const char* name) {
  expectColumns(array, 6, name);
  std::vector<CellBox> boxes;
  for (py::ssize_t i = 0; i < array.size() / 6; ++i) {
    boxes.push_back(
        boxOfRow(grid, array.data() + 6 * i, std::string(name) + "[" + std::to_string(i) + "]"));
  }
  return boxes;
}

Eigen::Isometry3d toPose(const Doubles& array, const char* name) {
  constexpr double kTolerance = 1e-3;  // For matrices that were float32.
  if (array.ndim() != 2 || array.shape(0) != 4 || array.shape(1) != 4) {
    throw Error(std::string(name) + " must have the shape (4, 4); it has " + shapeOf(array));
  }
  const Eigen::Matrix4d matrix =
      Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(array.data());
  const Eigen::Matrix3d rotation = matrix.topLeftCorner<3, 3>();
  const bool is_pose =
      matrix.allFinite() && matrix.row(3).isApprox(Eigen::RowVector4d(0, 0, 0, 1), kTolerance) &&
      (rotation.transpose() * rotation).isIdentity(kTolerance) && rotation.determinant() > 0.0;
  if (!is_pose) {
    throw Error(std::string(name) +
                " must be a rigid transform: a rotation, a translation, and (0, 0, 0, 1) below");
  }
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = rotation;
  pose.translation() = matrix.topRightCorner<3, 1>();
  return pose;
}

Occupancy toOccupancy(const py::object& value) {
  for (const Occupancy each : {Occupancy::kUnknown, Occupancy::kFree, Occupancy::kOccupied}) {
    if (value.equal(py::str(toString(each))) || value.equal(py::int_(static_cast<int>(each)))) {
      return each;
    }
  }
  throw Error("occupancy is " + py::repr(value).cast<std::string>() +
              ": use 'unknown', 'free', 'occupied', or one of cuboid_map.Occupancy");
}

CuboidFilter toFilter(const std::string& text) {
  if (text == "all") return CuboidFilter::kAll;
  if (text == "free") return CuboidFilter::kFree;
  if (text == "occupied") return CuboidFilter::kOccupied;
  throw Error("classes is '" + text + "': use 'all', 'free' or 'occupied'");
}

UnknownPolicy toUnknownPolicy(const std::string& text) {
  if (text == "obstacle") return UnknownPolicy::kObstacle;
  if (text == "free") return UnknownPolicy::kFree;
  throw Error("unknown is '" + text + "': use 'obstacle' or 'free'");
}

}  // namespace cuboid_map_python
