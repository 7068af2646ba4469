// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"

#include <pybind11/pybind11.h>

#include <mutex>
#include <shared_mutex>
#include <string>
#include <utility>

namespace cuboid_map_python {

namespace py = pybind11;

/// A map that Python holds. Readers run side by side, changes alone. All wait for the lock, and hold it,
/// without the GIL, so that GIL and lock cannot wait for each other.
class MapAccess {
 public:
  MapAccess() = default;
  MapAccess(const MapAccess&) = delete;
  MapAccess& operator=(const MapAccess&) = delete;
  virtual ~MapAccess() = default;

  /// @param work  (const CuboidMap&) -> a value without Python objects in it.
  template <typename WorkT>
  auto read(WorkT work) {
    const py::gil_scoped_release release;
    std::shared_lock<std::shared_mutex> lock(mutex_);
    while (!isSettled()) {
      lock.unlock();
      {
        const std::unique_lock<std::shared_mutex> alone(mutex_);
        settle();
      }
      lock.lock();
    }
    return work(map());
  }

  [[nodiscard]] cuboid_mapping::Grid grid() {
    return read([](const cuboid_mapping::CuboidMap& map) { return map.grid(); });
  }

  std::string frame_id;  ///< Frame of the map; guarded by the GIL.

 protected:
  /// @param work  Changes the map.
  template <typename WorkT>
  auto change(WorkT work) {
    const py::gil_scoped_release release;
    const std::unique_lock<std::shared_mutex> lock(mutex_);
    return work();
  }

  /// Whether map() may be read; guarded by the lock.
  [[nodiscard]] virtual bool isSettled() const { return true; }
  /// Makes map() readable. @pre Nobody else has the lock.
  virtual void settle() {}
  /// The map. @throws std::runtime_error  if there is none yet.
  [[nodiscard]] virtual const cuboid_mapping::CuboidMap& map() const = 0;

 private:
  std::shared_mutex mutex_;
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
