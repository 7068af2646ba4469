// SPDX-License-Identifier: BSD-3-Clause
// One face for all maps that are measured.
#pragma once

#include "cuboid_mapping/geometry/cell_box.h"
#include "cuboid_mapping/interop/octomap_parity.h"
#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/occupancy/sensor_model.h"
#include "cuboid_mapping/scan/scan.h"

#include <Eigen/Core>

#include <limits>
#include <memory>
#include <optional>
#include <string>

namespace cuboid_mapping::bench {

/// What a map holds; a cell is a cuboid, a leaf of an octree (pruned or not), a voxel of a grid.
struct MapFigures {
  std::size_t cells = 0;
  std::size_t occupied_cells = 0;
  std::size_t free_cells = 0;
  std::size_t leaf_nodes = 0;
  std::size_t inner_nodes = 0;
  std::size_t bytes_own = 0;  ///< What the map itself says.
  /// Part of the insertion; NaN where it cannot be told apart.
  double ray_walk_cpu_s = std::numeric_limits<double>::quiet_NaN();
  /// Clouds of which a part was walked by columns, see ColumnWalk; NaN for maps with another walk.
  double clouds_by_columns = std::numeric_limits<double>::quiet_NaN();
};

/// A ray of kRayRange_m.
struct RayQuery {
  Eigen::Vector3d origin_map;
  Eigen::Vector3d direction;  ///< Unit vector.
};
constexpr double kRayRange_m = 30.0;

/// Kinds of queries, of which a map may offer some.
enum class QueryKind : unsigned char { kPoint, kBox, kRay };

/// A map that is filled and asked. Not thread-safe.
class MapAdapter {
 public:
  virtual ~MapAdapter() = default;
  [[nodiscard]] virtual std::string name() const = 0;  ///< Its key in the report.

  virtual void insert(const Scan& scan) = 0;
  /// Called once behind the last scan, inside the insertion's time.
  virtual void finish() {}
  /// Frees what only insertion needs; nothing can be inserted afterwards.
  virtual void dropScratch() = 0;
  /// Frees the map; nothing can be asked afterwards.
  virtual void dropMap() = 0;

  /// Whether its interface has such queries. The others are not asked.
  [[nodiscard]] virtual bool offers(QueryKind /*kind*/) const { return true; }

  [[nodiscard]] virtual MapFigures figures() const = 0;
  /// Sum of the x coordinates of all occupied cells, which makes it visit them.
  [[nodiscard]] virtual double visitOccupied() const = 0;
  [[nodiscard]] virtual Occupancy classifyPoint(const Eigen::Vector3d& point_map) const = 0;
  [[nodiscard]] virtual bool isAnyOccupied(const CellBox& box) const = 0;
  /// Distance of the first occupied cell; unknown space is passed. Nothing within the range: nothing.
  [[nodiscard]] virtual std::optional<double> castRay(const RayQuery& ray) const = 0;
};

/// A map that cuboid_mapping is measured against.
class PeerAdapter : public MapAdapter {
 public:
  /// Whether it is exact for scans with an anchor, which lie far from the origin.
  [[nodiscard]] virtual bool takesAnchors() const { return true; }
  [[nodiscard]] virtual Agreement compareWith(const CuboidMap& map) const = 0;
};

/// What all maps have to agree about.
struct InsertionConfig {
  MapConfig map;
  double max_range_m = 0.0;  ///< > 0; infinity for no limit.
};

/// OctoMap, which knows only Environment::kDynamic, as octomap_server calls it; with searches by its iterators.
[[nodiscard]] std::unique_ptr<PeerAdapter> makeOctomapAdapter(const InsertionConfig& config);

/// The same voxels with lazy_eval: inner nodes are updated and pruned once, at the end; with searches by descent.
[[nodiscard]] std::unique_ptr<PeerAdapter> makeLazyOctomapAdapter(const InsertionConfig& config);

/// OctoMap's insertPointCloud with discretize: one ray for all points of a voxel, to its center. Not asked.
[[nodiscard]] std::unique_ptr<PeerAdapter> makeDiscreteOctomapAdapter(
    const InsertionConfig& config);

/// Where this program was built with them: see peers.h.
///@{
/// An OpenVDB float grid of log-odds, filled as vdb_mapping does it: an active voxel is known.
[[nodiscard]] std::unique_ptr<PeerAdapter> makeOpenvdbAdapter(const InsertionConfig& config);

/// A grid of Bonxai with log-odds, filled in the same way.
[[nodiscard]] std::unique_ptr<PeerAdapter> makeBonxaiAdapter(const InsertionConfig& config);

/// Bonxai's own ProbabilisticMap: other rays, and some voxels are left out. Knows no static environment.
[[nodiscard]] std::unique_ptr<PeerAdapter> makeBonxaiMapAdapter(const InsertionConfig& config);

/// UFOMap as its own server calls it: other rays, whose last voxel is a miss, too. Knows no static environment.
[[nodiscard]] std::unique_ptr<PeerAdapter> makeUfomapAdapter(const InsertionConfig& config);

/// A wavelet octree of wavemap, filled voxel by voxel with our updates. Knows no static environment.
[[nodiscard]] std::unique_ptr<PeerAdapter> makeWavemapAdapter(const InsertionConfig& config);

/// A map of ohm, filled voxel by voxel with our updates.
[[nodiscard]] std::unique_ptr<PeerAdapter> makeOhmAdapter(const InsertionConfig& config);

/// The same with ohm's RayMapperOccupancy: each beam counts, so that a cloud updates a voxel many times.
[[nodiscard]] std::unique_ptr<PeerAdapter> makeOhmRaysAdapter(const InsertionConfig& config);

/// A dense grid of mrpt with log-odds in steps of 1/16, filled voxel by voxel with our updates. Knows no static
/// environment.
[[nodiscard]] std::unique_ptr<PeerAdapter> makeMrptAdapter(const InsertionConfig& config);

/// A D-Map, which keeps unknown space and the voxels that points ever lay in, and has no log-odds. Knows no
/// static environment.
[[nodiscard]] std::unique_ptr<PeerAdapter> makeDmapAdapter(const InsertionConfig& config);
///@}

}  // namespace cuboid_mapping::bench
