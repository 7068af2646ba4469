// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "indexes/cuboid_index.h"
#include "queries.h"

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace cuboid_mapping::bench {

/// Queries of one kind.
struct IndexQueries {
  std::string name;
  std::size_t count = 0;
  /// Answers a query by its number, as a sum that does not depend on the order of what is found.
  std::function<std::uint64_t(const CuboidIndex&, std::size_t)> ask;
};

/// Sum of the portals of buildFreeGraph(map, region, {0, 0, 0}), and their number.
struct Portals {
  std::uint64_t sum = 0;
  std::size_t count = 0;
};
/// The neighbours of all free cuboids of a region, each pair once: searches as in buildFreeGraph().
[[nodiscard]] Portals findPortals(const CuboidIndex& index, const CellBox& region);

/// One kind after the other: visits, boxes, regions, points, nearest cuboids, graphs of free cuboids.
/// @param queries  Of makeQueries(). @param places_map  Where the sensor was.
[[nodiscard]] std::vector<IndexQueries> makeIndexQueries(
    const CuboidMap& map, const ByPlace<QuerySet>& queries,
    const std::vector<Eigen::Vector3d>& places_map);

}  // namespace cuboid_mapping::bench
