// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/function_ref.h"
#include "cuboid_mapping/map/cuboid_map.h"

#include <pybind11/pybind11.h>

#include <optional>
#include <string>
#include <type_traits>
#include <utility>

namespace cuboid_map_python {

namespace py = pybind11;

/// A map that Python holds. Readers run side by side. They wait for locks, and hold them, without the GIL, but for
/// looks at signals, so that GIL and lock cannot wait for each other.
class MapAccess {
 public:
  MapAccess() = default;
  MapAccess(const MapAccess&) = delete;
  MapAccess& operator=(const MapAccess&) = delete;
  virtual ~MapAccess() = default;

  /// @param work  (const CuboidMap&) -> a value without Python objects in it.
  template <typename WorkT>
  auto read(WorkT work) {
    using Result = std::decay_t<std::invoke_result_t<WorkT&, const cuboid_mapping::CuboidMap&>>;
    const py::gil_scoped_release release;
    if constexpr (std::is_void_v<Result>) {
      withMap([&](const cuboid_mapping::CuboidMap& map) { work(map); });
    } else {
      std::optional<Result> result;
      withMap([&](const cuboid_mapping::CuboidMap& map) { result.emplace(work(map)); });
      return std::move(*result);
    }
  }

  [[nodiscard]] cuboid_mapping::Grid grid() {
    return read([](const cuboid_mapping::CuboidMap& map) { return map.grid(); });
  }

  std::string frame_id;  ///< Frame of the map; guarded by the GIL.

 protected:
  using MapReader = cuboid_mapping::FunctionRef<void(const cuboid_mapping::CuboidMap&)>;
  /// Calls work with the map, which does not change meanwhile. Without the GIL.
  /// @throws std::runtime_error  There is none yet.
  virtual void withMap(MapReader work) = 0;
};

using MapClass = py::class_<MapAccess>;

/// Declares cuboid_map.Map, with all functions that do not change a map.
MapClass bindMap(py::module& module);
/// Adds the queries for planners.
void bindPlannerQueries(MapClass& map);
/// Adds the queries for bodies that turn.
void bindBodyQueries(MapClass& map);
/// Adds covers and free boxes, frontiers, and distances.
void bindBoxQueries(MapClass& map);
/// Declares cuboid_map.Mapper.
void bindMapper(py::module& module, const MapClass& map);
/// Declares cuboid_map.MapFollower.
void bindFollower(py::module& module, const MapClass& map);

}  // namespace cuboid_map_python
