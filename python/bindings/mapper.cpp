// SPDX-License-Identifier: BSD-3-Clause
// cuboid_map.Mapper: scans in, map out.
#include "arrays.h"
#include "config.h"
#include "cuboid_mapping/geometry/float_anchor.h"
#include "cuboid_mapping/io/map_files.h"
#include "cuboid_mapping/io/text.h"
#include "map_access.h"

#include <memory>
#include <mutex>
#include <shared_mutex>

namespace cuboid_map_python {
namespace {

using namespace cuboid_mapping;
using py::literals::operator""_a;

/// Voxels that set_boxes() fills at most; ~set_box has a limit of bricks.
constexpr double kMaxSetVoxels = 1e9;

/// A scan as it comes from Python.
struct GivenScan {
  Eigen::Isometry3d T_map_sensor = Eigen::Isometry3d::Identity();
  Eigen::Vector3d origin_map = Eigen::Vector3d::Zero();
  /// Origin of the points: zero, or near the start of the beams if that is far from the origin.
  Eigen::Vector3d anchor_sensor = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector3f> points_anchor;
  std::vector<Eigen::Vector3f> no_returns_anchor;
};

class MapperAccess : public MapAccess {
 private:
  /// Changes run alone. @param work  Changes the map.
  template <typename WorkT>
  auto change(WorkT work) {
    const py::gil_scoped_release release;
    const std::unique_lock<std::shared_mutex> lock(mutex_);
    return work();
  }

 public:
  explicit MapperAccess(const MapperConfig& config) : mapper_(config), map_(mapper_.map()) {}

  /// Counts of the points of a scan.
  struct Counts {
    std::size_t num_taken;
    std::size_t num_out_of_range;
    std::size_t num_too_far;
  };

  Counts integrate(const GivenScan& given) {
    return change([&] {
      is_settled_ = false;
      mapper_.integrate(makeScan(given.T_map_sensor * Eigen::Translation3d(given.anchor_sensor),
                                 given.origin_map, given.points_anchor, given.no_returns_anchor));
      const ScanUpdate& update = mapper_.lastUpdate();
      return Counts{update.num_points, update.num_out_of_range, update.num_too_far};
    });
  }

  /// Resolution of the grid; constant.
  [[nodiscard]] double resolution_m() const { return map_.grid().resolution(); }

  template <typename WorkT>
  void edit(WorkT work) {
    change([&] {
      is_settled_ = false;
      work(mapper_.map());
      is_settled_ = true;
    });
  }

 protected:
  void withMap(MapReader work) override {
    std::shared_lock<std::shared_mutex> lock(mutex_);
    while (!is_settled_) {
      lock.unlock();
      settle();
      lock.lock();
    }
    work(map_);
  }

 private:
  void settle() {
    const std::unique_lock<std::shared_mutex> lock(mutex_);
    (void)mapper_.map();
    is_settled_ = true;
  }

  std::shared_mutex mutex_;
  Mapper mapper_;
  const CuboidMap& map_;  ///< Map of the mapper.
  bool is_settled_ = true;
};

/// Points as float32 relative to an anchor. @throws Error for doubles that would move by a tenth of a voxel.
std::vector<Eigen::Vector3f> toAnchor(const py::object& array, const char* name,
                                      const Eigen::Vector3d& anchor, double resolution_m) {
  if (anchor.isZero(0.0) && py::isinstance<py::array_t<float>>(array)) {
    return toPoints(array.cast<Floats>(), name);
  }
  const std::vector<Eigen::Vector3d> points = toPoints(array.cast<Doubles>(), name);
  const double max_range_m = 0.1 * resolution_m * (1 << 24);
  std::vector<Eigen::Vector3f> points_anchor;
  points_anchor.reserve(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d point = points[i] - anchor;
    if (point.allFinite() && point.cwiseAbs().maxCoeff() > max_range_m) {
      throw Error(
          std::string(name) + "[" + std::to_string(i) + "] is more than " +
          std::to_string(static_cast<long long>(max_range_m)) +
          " m from the start of the beams, where float32 rounds it by a tenth of a voxel or "
          "more: give pose or origin, or leave the point out");
    }
    points_anchor.emplace_back(point.cast<float>());
  }
  return points_anchor;
}

py::object integrate(MapperAccess& access, const py::object& points, const py::object& pose,
                     const py::object& origin, const py::object& no_returns) {
  GivenScan scan;
  if (!pose.is_none()) scan.T_map_sensor = toPose(pose.cast<Doubles>(), "pose");
  scan.origin_map = scan.T_map_sensor.translation();
  if (!origin.is_none()) scan.origin_map = toVector(origin.cast<Doubles>(), "origin");
  if (!scan.origin_map.allFinite()) throw Error("origin must be finite");
  const double resolution_m = access.resolution_m();
  scan.anchor_sensor = floatAnchor(scan.T_map_sensor.inverse() * scan.origin_map);
  scan.points_anchor = toAnchor(points, "points", scan.anchor_sensor, resolution_m);
  if (!no_returns.is_none()) {
    scan.no_returns_anchor = toAnchor(no_returns, "no_returns", scan.anchor_sensor, resolution_m);
  }
  const MapperAccess::Counts counts = access.integrate(scan);
  return makeResult("IntegratedScan", counts.num_taken, counts.num_out_of_range,
                    counts.num_too_far);
}

std::unique_ptr<MapperAccess> load(const FileName& file, const py::kwargs& arguments) {
  if (arguments.contains("resolution")) {
    throw Error("the resolution of a map that is loaded is that of the file");
  }
  MapperConfig config = parseConfig(arguments, {});
  MapFile loaded;
  {
    const py::gil_scoped_release release;
    loaded = readMapFile(file.text, config.map.sensor_model);
  }
  config.map.resolution_m = loaded.snapshot.resolution_m;
  config.map.sensor_model = loaded.snapshot.sensor_model;
  config.map.environment = loaded.snapshot.environment;
  auto mapper = std::make_unique<MapperAccess>(parseConfig(arguments, config));
  mapper->frame_id = loaded.snapshot.frame_id;
  mapper->edit([&](CuboidMap& map) { restoreSnapshot(std::move(loaded.snapshot), map); });
  return mapper;
}

void setBoxes(MapperAccess& access, const Doubles& array, const py::object& value) {
  const Occupancy occupancy = toOccupancy(value);
  const Grid grid = access.read([](const CuboidMap& map) { return map.grid(); });
  const std::vector<CellBox> boxes = toCellBoxes(grid, array, "boxes");
  double num_voxels = 0.0;
  for (const CellBox& box : boxes) num_voxels += box.numVoxels();
  if (occupancy != Occupancy::kUnknown && num_voxels > kMaxSetVoxels) {
    throw Error("boxes have " + toText(num_voxels) +
                " voxels: at most 1e9 can be made free or occupied at once");
  }
  access.edit([&](CuboidMap& map) {
    const SensorModel& model = map.sensorModel();
    const float log_odds = occupancy == Occupancy::kOccupied ? model.max() : model.min();
    for (const CellBox& box : boxes) {
      std::vector<UniformBox> content;
      if (occupancy != Occupancy::kUnknown) content.push_back({box, log_odds});
      map.replace(box, content);
    }
  });
}

}  // namespace

void bindMapper(py::module& module, const MapClass& /*map*/) {
  static const std::string kHelp = std::string(R"(A map that is made from scans.
)") + kConfigHelp + R"(
Raises ValueError with a line for each argument that is wrong.)";
  static const std::string kLoadHelp = std::string(R"(A mapper with the map of a file.

file: .cuboids, .sqlite, .ot or .bt; its first bytes tell which.
Further arguments are those of Mapper, except resolution. Sensor model and environment are those of the file unless given;
OctoMap's files have none.
Raises MapFileError when the file cannot be read, ValueError for wrong arguments.)");
  py::class_<MapperAccess, MapAccess> mapper(module, "Mapper", kHelp.c_str());
  mapper.def(py::init([](const py::kwargs& arguments) {
    return std::make_unique<MapperAccess>(parseConfig(arguments, {}));
  }));
  mapper.def_static("load", load, "file"_a, kLoadHelp.c_str());
  mapper.def("integrate", integrate, "points"_a, "pose"_a = py::none(), "origin"_a = py::none(),
             "no_returns"_a = py::none(),
             R"(Takes one scan: every voxel that its beams pass or end in is observed once.

points: (n, 3), metres, in the frame of the sensor; contiguous float32 arrays are fastest. float64 stays exact far from the
  origin if pose or origin gives the start of the beams. Points that are not finite are left out, and counted.
pose: (4, 4): takes points from the sensor's frame to the map's. None: they are in the map's frame.
origin: (3,), metres, map frame: start of the beams. None: the translation of the pose.
no_returns: (m, 3), as points: ends of the known free part of beams without return.
Returns results.IntegratedScan. Raises ValueError for a wrong shape, a pose that is no rotation and translation, and
float64 points too far from the start of the beams to be exact.
With threads > 1, the scan enters the map while the caller goes on; queries wait for it.)");
  mapper.def("set_boxes", setBoxes, "boxes"_a, "occupancy"_a,
             R"(Makes all voxels of boxes free, occupied or unknown.

boxes: (n, 6), metres, map frame; every voxel that a box overlaps.
occupancy: 'free', 'occupied' (at the clamping thresholds) or 'unknown', or an Occupancy.)");
  mapper.def(
      "clear", [](MapperAccess& access) { access.edit([](CuboidMap& map) { map.clear(); }); },
      "Forgets everything.");
}

}  // namespace cuboid_map_python
