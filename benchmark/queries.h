// SPDX-License-Identifier: BSD-3-Clause
// The same questions to all maps.
#pragma once

#include "map_adapter.h"
#include "timing.h"

#include <limits>
#include <vector>

namespace cuboid_mapping::bench {

constexpr double kQueryBox_m = 2.0;

/// Something for queries at uniformly random places, and for queries near surfaces.
template <typename T>
struct ByPlace {
  T uniform;
  T near_surface;
};

/// Queries of one place.
struct QuerySet {
  std::vector<Eigen::Vector3d> points_map;
  std::vector<CellBox> boxes;  ///< Cubes of kQueryBox_m, rounded to voxels.
  std::vector<RayQuery> rays;
};

/// Random queries, the same for the same map and scans.
///
/// Uniform: anywhere in the bounding box of the map; rays start at a scan's origin, in any
/// direction. Near surfaces: points within 0.5 m of an occupied voxel on each axis, boxes whose
/// centre is within 2 m of one, rays from a scan's origin to within 0.2 m of one of its points.
/// Points keep off the faces of voxels, where float and double round differently.
/// @throws std::runtime_error when the map or the scans have nothing to ask for.
[[nodiscard]] ByPlace<QuerySet> makeQueries(const CuboidMap& map, const std::vector<Scan>& scans);

/// Answers to the first queries of a set: those for which there was time.
struct QueryAnswers {
  std::vector<Occupancy> points;
  std::vector<char> boxes;     ///< Whether any voxel is occupied.
  std::vector<double> rays_m;  ///< Distance of the first occupied cell, at most kRayRange_m.
};

/// Queries per second of CPU time; NaN if the map does not offer them.
struct QueryRates {
  double points_per_s = std::numeric_limits<double>::quiet_NaN();
  double boxes_per_s = std::numeric_limits<double>::quiet_NaN();
  double rays_per_s = std::numeric_limits<double>::quiet_NaN();
};

struct QueryRun {
  QueryRates rates;
  QueryAnswers answers;
};

/// Asks all queries of a kind, or as many as half a second is enough for; then the same again and again to
/// time them, for this CPU time at least.
[[nodiscard]] QueryRun askQueries(const MapAdapter& map, const QuerySet& queries,
                                  double min_cpu_s = kTimedQueries_s);

/// How many answers to the same queries differ.
struct Differences {
  std::size_t compared = 0;
  std::size_t different = 0;
};

struct AnswerDifferences {
  Differences points;
  Differences boxes;
  Differences rays;
};

/// Compares the answers that both have. Distances of rays may differ by two voxels: OctoMap answers
/// with the centre of a voxel; a ray that hits nothing counts as one that hits at its end.
[[nodiscard]] AnswerDifferences compareAnswers(const QueryAnswers& a, const QueryAnswers& b,
                                               double resolution_m);

}  // namespace cuboid_mapping::bench
