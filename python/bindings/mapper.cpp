// SPDX-License-Identifier: BSD-3-Clause
// cuboid_map.Mapper: scans in, map out.
#include "arrays.h"
#include "config.h"
#include "cuboid_mapping/io/map_files.h"
#include "map_access.h"

#include <memory>

namespace cuboid_map_python {
namespace {

using namespace cuboid_mapping;
using py::literals::operator""_a;

/// Voxels that set_boxes() fills at most; ~set_box has the same limit.
constexpr double kMaxSetVoxels = 1e9;

/// A scan as it comes from Python.
struct GivenScan {
  Eigen::Isometry3d T_map_sensor = Eigen::Isometry3d::Identity();
  Eigen::Vector3d origin_map = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector3f> points_sensor;
  std::vector<Eigen::Vector3f> no_returns_sensor;
};

class MapperAccess : public MapAccess {
 public:
  explicit MapperAccess(const MapperConfig& config) : mapper_(config), map_(mapper_.map()) {}

  /// What became of the points of a scan.
  struct Counts {
    std::size_t num_taken;
    std::size_t num_out_of_range;
    std::size_t num_too_far;
  };

  Counts integrate(const GivenScan& given) {
    return change([&] {
      is_settled_ = false;
      mapper_.integrate(makeScan(given.T_map_sensor, given.origin_map, given.points_sensor,
                                 given.no_returns_sensor));
      const ScanUpdate& update = mapper_.lastUpdate();
      return Counts{update.num_points, update.num_out_of_range, update.num_too_far};
    });
  }

  template <typename WorkT>
  void edit(WorkT work) {
    change([&] {
      settle();
      work(mapper_.map());
    });
  }

 protected:
  [[nodiscard]] bool isSettled() const override { return is_settled_; }
  void settle() override {
    static_cast<void>(mapper_.map());  // Waits for the scan that is put into the map, if one is.
    is_settled_ = true;
  }
  [[nodiscard]] const CuboidMap& map() const override { return map_; }

 private:
  Mapper mapper_;
  const CuboidMap& map_;  ///< That of the mapper.
  bool is_settled_ = true;
};

py::object integrate(MapperAccess& access, const Floats& points, const py::object& pose,
                     const py::object& origin, const py::object& no_returns) {
  GivenScan scan;
  scan.points_sensor = toPoints(points, "points");
  if (!no_returns.is_none()) {
    scan.no_returns_sensor = toPoints(no_returns.cast<Floats>(), "no_returns");
  }
  if (!pose.is_none()) scan.T_map_sensor = toPose(pose.cast<Doubles>(), "pose");
  scan.origin_map = scan.T_map_sensor.translation();
  if (!origin.is_none()) scan.origin_map = toVector(origin.cast<Doubles>(), "origin");
  if (!scan.origin_map.allFinite()) throw Error("origin must be finite");
  const MapperAccess::Counts counts = access.integrate(scan);
  return makeResult("IntegratedScan", counts.num_taken, counts.num_out_of_range,
                    counts.num_too_far);
}

std::unique_ptr<MapperAccess> load(const std::string& file, const py::kwargs& arguments) {
  if (arguments.contains("resolution")) {
    throw Error("the resolution of a map that is loaded is that of the file");
  }
  MapperConfig config = parseConfig(arguments, {});
  MapFile loaded;
  {
    const py::gil_scoped_release release;
    loaded = readMapFile(file, config.map.sensor_model);
  }
  config.map.resolution_m = loaded.snapshot.resolution_m;
  config.map.sensor_model = loaded.snapshot.sensor_model;
  config.map.environment = loaded.snapshot.environment;
  auto mapper = std::make_unique<MapperAccess>(parseConfig(arguments, config));
  mapper->frame_id = loaded.snapshot.frame_id;
  mapper->edit([&](CuboidMap& map) { restoreSnapshot(loaded.snapshot, map); });
  return mapper;
}

void setBoxes(MapperAccess& access, const Doubles& array, const py::object& value) {
  const Occupancy occupancy = toOccupancy(value);
  const Grid grid = access.read([](const CuboidMap& map) { return map.grid(); });
  const std::vector<CellBox> boxes = toCellBoxes(grid, array, "boxes");
  double num_voxels = 0.0;
  for (const CellBox& box : boxes) num_voxels += box.numVoxels();
  if (occupancy != Occupancy::kUnknown && num_voxels > kMaxSetVoxels) {
    throw Error("boxes have " + std::to_string(num_voxels) +
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
  static const std::string kHelp = std::string(R"(A map that is made of scans.
)") + kConfigHelp + R"(
Raises ValueError with a line for each argument that is wrong.)";
  static const std::string kLoadHelp = std::string(R"(A mapper with the map of a file.

file: .cuboids, .sqlite, .ot or .bt; its first bytes tell which.
Further arguments are those of Mapper, but for resolution. The sensor model and the environment of a
.cuboids file count where none are given; OctoMap's files have none.
Raises MapFileError when the file cannot be read, ValueError for wrong arguments.)");
  py::class_<MapperAccess, MapAccess> mapper(module, "Mapper", kHelp.c_str());
  mapper.def(py::init([](const py::kwargs& arguments) {
    return std::make_unique<MapperAccess>(parseConfig(arguments, {}));
  }));
  mapper.def_static("load", load, "file"_a, kLoadHelp.c_str());
  mapper.def("integrate", integrate, "points"_a, "pose"_a = py::none(), "origin"_a = py::none(),
             "no_returns"_a = py::none(),
             R"(Takes one scan: every voxel that its beams pass or end in is observed once.

points: (n, 3), metres, in the frame of the sensor; best as float32 without a gap in memory. Points
  that are not finite are left out, and counted.
pose: (4, 4): takes points from the sensor's frame to the map's. None: they are in the map's frame.
origin: (3,), metres, map frame: where the beams start. None: the translation of the pose.
no_returns: (m, 3), as points: ends of beams that met nothing and are known to be free up to there.
Returns results.IntegratedScan. Raises ValueError for a wrong shape, and a pose that is none.
With threads > 1, the scan is put into the map beside what comes next; questions wait for it.)");
  mapper.def("set_boxes", setBoxes, "boxes"_a, "occupancy"_a,
             R"(Puts one class in the place of everything in boxes.

boxes: (n, 6), metres, map frame; every voxel that a box overlaps.
occupancy: 'free', 'occupied' (at the clamping thresholds) or 'unknown', or an Occupancy.)");
  mapper.def(
      "clear", [](MapperAccess& access) { access.edit([](CuboidMap& map) { map.clear(); }); },
      "Forgets everything.");
}

}  // namespace cuboid_map_python
