// SPDX-License-Identifier: BSD-3-Clause
// cuboid_map._core: the library for Python.
#include "arrays.h"
#include "cuboid_mapping/io/map_files.h"
#include "cuboid_mapping/scan/no_return_beams.h"
#include "map_access.h"

namespace cuboid_map_python {
namespace {

using py::literals::operator""_a;

std::size_t convert(const FileName& source, const FileName& target) {
  if (!cuboid_mapping::formatOfName(target.text)) {
    throw Error(target.text + ": the name must end in one of " + cuboid_mapping::knownEndings());
  }
  const py::gil_scoped_release release;
  return cuboid_mapping::writeMapFile(target.text,
                                      cuboid_mapping::readMapFile(source.text).snapshot);
}

py::array_t<float> findNoReturnBeams(const Floats& cloud) {
  if (cloud.ndim() != 3 || cloud.shape(2) != 3) {
    throw Error("cloud must have the shape (rows, columns, 3)");
  }
  const auto height = static_cast<std::size_t>(cloud.shape(0));
  const auto width = static_cast<std::size_t>(cloud.shape(1));
  const std::vector<Eigen::Vector3f> points =
      toPoints(Floats(cloud.attr("reshape")(-1, 3)), "cloud");
  std::vector<float> directions;
  {
    const py::gil_scoped_release release;
    for (const auto& beam : cuboid_mapping::estimateNoReturnBeams(points, width, height).beams) {
      const Eigen::Vector3f& direction = beam.direction;
      directions.insert(directions.end(), direction.data(), direction.data() + 3);
    }
  }
  return toRows(std::move(directions), 3);
}

}  // namespace
}  // namespace cuboid_map_python

PYBIND11_MODULE(_core, module) {
  using namespace cuboid_map_python;
  module.doc() = "The part of cuboid_map that is written in C++.";
  py::register_exception<cuboid_mapping::MapFileError>(module, "MapFileError", PyExc_OSError);
  MapClass map = bindMap(module);
  bindPlannerQueries(map);
  bindBodyQueries(map);
  bindBoxQueries(map);
  bindMapper(module, map);
  bindFollower(module, map);
  module.def(
      "convert", convert, "source"_a, "target"_a,
      R"(Writes the map of a file in another format, which the extension of the target chooses.

source: .cuboids, .sqlite, .ot or .bt. target: these, .pcd, .ply or .csv.
Returns the size of the target in bytes. Raises MapFileError, or ValueError for another extension.)");
  module.def("find_no_return_beams", findNoReturnBeams, "cloud"_a,
             R"(Estimates the directions of the beams without return of an organized cloud.

cloud: (rows, columns, 3), metres, sensor frame; not finite or (0, 0, 0): no return.
Returns (n, 3) float32 unit vectors, estimated from the beams with a return; none if these fit neither a lidar that turns
about z nor a camera. Multiplied by a range that is known to be free, they are `no_returns` for Mapper.integrate().)");
}
