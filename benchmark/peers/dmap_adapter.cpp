// SPDX-License-Identifier: BSD-3-Clause
#include "map_adapter.h"

#include "peers/beams.h"

#include "cuboid_mapping/geometry/grid.h"
#include "cuboid_mapping/query/value_query.h"

#define ROOT_DIR "/tmp/"  // of a log that is off; its header wants it
#include <D-Map/D-Map.h>

#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <set>

namespace cuboid_mapping::bench {
namespace {

/// Edge of its cube around the origin, in voxels: 205 m at 0.05 m.
constexpr std::int32_t kEdge = 4096;

/// Its octree of unknown space.
struct Tree {
  std::vector<CellBox> known;  ///< Cubes of children that are not there.
  std::size_t num_unknown = 0;
  std::size_t num_inner = 0;
};

/// Reads a node and those below it: for each a mask of its children, 0 for a leaf.
void readNode(std::istream& file, const CellBox& cube, Tree& tree) {
  unsigned children = 0;
  file >> children;
  ++(children == 0 ? tree.num_unknown : tree.num_inner);
  if (children == 0) return;
  const std::int32_t half = cube.size().x / 2;
  for (int i = 0; i < 8; ++i) {
    const Cell min = cube.min + Cell{(i & 1) * half, (i >> 1 & 1) * half, (i >> 2) * half};
    const CellBox child{min, min + Cell{half, half, half}};
    if ((children >> i & 1U) != 0) {
      readNode(file, child, tree);
    } else {
      tree.known.push_back(child);
    }
  }
}

/// Its nodes cannot be visited, only written to a file.
Tree readTree(DMap::dmap& map) {
  const auto path = std::filesystem::temp_directory_path() / ("dmap" + std::to_string(getpid()));
  map.OutputMap(path, "/dev/null");
  std::ifstream file(path);
  std::string header;
  std::getline(file, header);  // resolution
  std::getline(file, header);  // bounds
  Tree tree;
  constexpr std::int32_t kHalf = kEdge / 2;
  readNode(file, {{-kHalf, -kHalf, -kHalf}, {kHalf, kHalf, kHalf}}, tree);
  std::filesystem::remove(path);
  return tree;
}

/// Angle [rad] between neighbouring points, if they lie on a square grid: from the solid angle that they cover.
double findSpacing(const std::vector<Eigen::Vector3f>& points, const Eigen::Vector3f& origin) {
  constexpr double kBins = 180.0;  // in azimuth; half as many in height: all have the same size
  std::set<std::pair<int, int>> bins;
  for (const Eigen::Vector3f& point : points) {
    const Eigen::Vector3d direction = (point - origin).cast<double>().normalized();
    bins.emplace(std::lround(kBins / 2.0 / M_PI * std::atan2(direction.y(), direction.x())),
                 std::lround(kBins / 4.0 * direction.z()));
  }
  const double covered_sr = static_cast<double>(bins.size()) * 4.0 * M_PI / (kBins * kBins / 2.0);
  return std::sqrt(covered_sr / static_cast<double>(points.size()));
}

/// Its range and the angle between the points are those of the first cloud; its field of view is all around.
class DmapAdapter : public PeerAdapter {
 public:
  explicit DmapAdapter(const InsertionConfig& config)
      : grid_(config.map.resolution_m), max_range_m_(config.max_range_m) {}

  [[nodiscard]] std::string name() const override { return "dmap"; }
  [[nodiscard]] bool takesAnchors() const override { return false; }
  /// It has neither a search of boxes nor one along a ray.
  [[nodiscard]] bool offers(QueryKind kind) const override { return kind == QueryKind::kPoint; }

  void insert(const Scan& scan) override {
    const std::vector<Eigen::Vector3f> points = finitePoints(scan);
    if (points.empty()) return;
    if (!map_) start(points, scan.origin);
    PointClouds cloud;
    cloud.reserve(points.size());
    for (const Eigen::Vector3f& point : points) {
      cloud.push_back(PointType(point.x(), point.y(), point.z()));
    }
    const Eigen::Matrix3f no_rotation = Eigen::Matrix3f::Identity();
    map_->UpdateMap(OdomType(no_rotation, scan.origin.x(), scan.origin.y(), scan.origin.z()),
                    cloud);
  }

  void dropScratch() override {}
  void dropMap() override { map_.reset(); }

  /// Cells are those that it keeps: cubes of unknown space and occupied voxels.
  [[nodiscard]] MapFigures figures() const override {
    const Tree tree = readTree(*map_);
    MapFigures figures;
    figures.occupied_cells = occupied().size();
    figures.leaf_nodes = tree.num_unknown;
    figures.inner_nodes = tree.num_inner;
    figures.cells = figures.leaf_nodes + figures.occupied_cells;
    figures.bytes_own = static_cast<std::size_t>(1024.0 * map_->getMemoryUsage_KB());
    return figures;
  }

  [[nodiscard]] double visitOccupied() const override {
    double sum = 0.0;
    for (const PointType& center : occupied()) sum += center.x;
    return sum;
  }

  [[nodiscard]] Occupancy classifyPoint(const Eigen::Vector3d& point_map) const override {
    if (map_->CheckOccupied(point_map)) return Occupancy::kOccupied;
    return map_->CheckUnknown(point_map) ? Occupancy::kUnknown : Occupancy::kFree;
  }

  [[nodiscard]] bool isAnyOccupied(const CellBox& /*box*/) const override { return false; }
  [[nodiscard]] std::optional<double> castRay(const RayQuery& /*ray*/) const override {
    return std::nullopt;
  }

  [[nodiscard]] Agreement compareWith(const CuboidMap& map) const override {
    Agreement agreement;
    agreement.max_log_odds_difference = std::numeric_limits<double>::quiet_NaN();  // has none
    double known_to_both = 0.0;
    const auto add = [&](const CellBox& cells, Occupancy occupancy, int sign) {
      agreement.voxels += sign * cells.numVoxels();
      visitValues(map, cells, Budget::unlimited(), [&](float log_odds, int count) {
        known_to_both += sign * count;
        if (classify(log_odds) != occupancy) agreement.class_mismatch += sign * count;
      });
    };
    for (const CellBox& cells : readTree(*map_).known) add(cells, Occupancy::kFree, 1);
    for (const PointType& center : occupied()) {
      const Eigen::Vector3d point_map(center.x, center.y, center.z);
      const CellBox cell = CellBox::ofCell(grid_.toCell(point_map).value());
      if (!map_->CheckUnknown(point_map)) add(cell, Occupancy::kFree, -1);
      add(cell, Occupancy::kOccupied, 1);
    }
    const double known = map.voxels().numFreeVoxels() + map.voxels().numOccupiedVoxels();
    agreement.known_mismatch = (agreement.voxels - known_to_both) + (known - known_to_both);
    return agreement;
  }

 private:
  void start(const std::vector<Eigen::Vector3f>& points, const Eigen::Vector3f& origin) {
    // Defaults of its configuration.
    constexpr float kAccuracy = 0.9F;
    constexpr float kFullRatio = 0.8F;
    constexpr float kLargestCube_m = 10.0F;
    // More than 90: else the tangent decides how far up its field of view reaches.
    const double elevation_deg = 90.01;
    double range_m = 0.0;
    for (const Eigen::Vector3f& point : points) {
      range_m = std::max<double>(range_m, (point - origin).norm());
    }
    std::vector<double> azimuths_deg{-180.0, 180.0};
    std::vector<double> elevations_deg{-elevation_deg, elevation_deg};
    std::vector<double> spacing_deg{findSpacing(points, origin) * 180.0 / M_PI};
    const auto resolution_m = static_cast<float>(grid_.resolution());
    map_ = std::make_unique<DMap::dmap>(resolution_m, kAccuracy, kFullRatio);
    map_->Set_Sensor_Params(0, azimuths_deg, elevations_deg,
                            static_cast<float>(std::min(max_range_m_, range_m)), spacing_deg,
                            spacing_deg);
    const float half_m = resolution_m * kEdge / 2;
    map_->Initialize({-half_m, half_m, -half_m, half_m, -half_m, half_m}, kLargestCube_m);
  }

  [[nodiscard]] PointVector occupied() const {
    PointVector centers;
    map_->occupied_pointcloud_visualize(centers);
    return centers;
  }

  Grid grid_;
  double max_range_m_;
  std::unique_ptr<DMap::dmap> map_;  ///< Made with the first cloud.
};

}  // namespace

std::unique_ptr<PeerAdapter> makeDmapAdapter(const InsertionConfig& config) {
  return std::make_unique<DmapAdapter>(config);
}

}  // namespace cuboid_mapping::bench
