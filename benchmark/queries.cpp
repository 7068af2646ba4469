// SPDX-License-Identifier: BSD-3-Clause
#include "queries.h"

#include "cuboid_mapping/map/cuboid_search.h"

#include <cmath>
#include <cstdint>
#include <random>
#include <stdexcept>

namespace cuboid_mapping::bench {
namespace {

constexpr std::size_t kNumPoints = 200000;
constexpr std::size_t kNumBoxes = 20000;
constexpr std::size_t kNumRays = 20000;
constexpr double kTimeForQueries_s = 0.5;

/// Random numbers that are the same with every compiler.
class Random {
 public:
  /// From `lower` to `upper`.
  double real(double lower, double upper) {
    return lower + (upper - lower) * (static_cast<double>(engine_() >> 11) * 0x1p-53);
  }

  std::int32_t integer(std::int32_t lower, std::int32_t upper) {
    return lower + static_cast<std::int32_t>(index(static_cast<std::size_t>(upper - lower) + 1));
  }

  std::size_t index(std::size_t size) { return static_cast<std::size_t>(engine_() % size); }

  Cell cellIn(const CellBox& box) {
    return {integer(box.min.x, box.max.x - 1), integer(box.min.y, box.max.y - 1),
            integer(box.min.z, box.max.z - 1)};
  }

  /// In a cube of this half edge.
  Eigen::Vector3d vector(double half_edge) {
    return {real(-half_edge, half_edge), real(-half_edge, half_edge), real(-half_edge, half_edge)};
  }

  Eigen::Vector3d direction() {
    while (true) {
      const Eigen::Vector3d v = vector(1.0);
      if (v.norm() > 0.1 && v.norm() <= 1.0) return v.normalized();
    }
  }

 private:
  std::mt19937_64 engine_{1};
};

/// Makes the queries of one map.
class QueryMaker {
 public:
  QueryMaker(const CuboidMap& map, const std::vector<Scan>& scans)
      : grid_(map.grid()), scans_(scans), edge_cells_(roundToCells(kQueryBox_m)) {
    const auto bounds = map.bounds();
    visitAll(map, CuboidFilter::kOccupied, [this](const Cuboid& cuboid) {
      surfaces_.push_back(cuboid.box);
      return Visit::kContinue;
    });
    if (!bounds || surfaces_.empty()) {
      throw std::runtime_error(
          "the map has no occupied voxels: there is nothing to measure queries with");
    }
    bounds_ = *bounds;
  }

  QuerySet makeUniform() {
    QuerySet queries;
    for (std::size_t i = 0; i < kNumPoints; ++i) {
      queries.points_map.push_back(pointIn(random_.cellIn(bounds_)));
    }
    for (std::size_t i = 0; i < kNumBoxes; ++i) {
      queries.boxes.push_back(boxFrom(random_.cellIn(bounds_)));
    }
    for (std::size_t i = 0; i < kNumRays; ++i) {
      queries.rays.push_back({originOf(anyScan()), random_.direction()});
    }
    return queries;
  }

  QuerySet makeNearSurface() {
    QuerySet queries;
    for (std::size_t i = 0; i < kNumPoints; ++i) {
      queries.points_map.push_back(pointIn(nearSurface(roundToCells(0.5))));
    }
    const Cell half{edge_cells_ / 2, edge_cells_ / 2, edge_cells_ / 2};
    for (std::size_t i = 0; i < kNumBoxes; ++i) {
      queries.boxes.push_back(boxFrom(nearSurface(edge_cells_) - half));
    }
    for (std::size_t i = 0; i < kNumRays; ++i) queries.rays.push_back(rayToSurface());
    return queries;
  }

 private:
  [[nodiscard]] std::int32_t roundToCells(double length_m) const {
    return std::max(1, static_cast<std::int32_t>(std::lround(length_m / grid_.resolution())));
  }

  const Scan& anyScan() { return scans_[random_.index(scans_.size())]; }

  static Eigen::Vector3d originOf(const Scan& scan) {
    return scan.anchor_map + scan.origin.cast<double>();
  }

  Eigen::Vector3d pointIn(const Cell& cell) {
    return grid_.centerOf(CellBox::ofCell(cell)) + random_.vector(0.4 * grid_.resolution());
  }

  [[nodiscard]] CellBox boxFrom(const Cell& min) const {
    return {min, min + Cell{edge_cells_, edge_cells_, edge_cells_}};
  }

  Cell nearSurface(std::int32_t distance) {
    const Cell offset{random_.integer(-distance, distance), random_.integer(-distance, distance),
                      random_.integer(-distance, distance)};
    return random_.cellIn(surfaces_[random_.index(surfaces_.size())]) + offset;
  }

  RayQuery rayToSurface() {
    constexpr int kMaxTries = 100000;
    for (int i = 0; i < kMaxTries; ++i) {
      const Scan& scan = anyScan();
      if (scan.points.empty()) continue;
      const Eigen::Vector3f& end = scan.points[random_.index(scan.points.size())];
      const Eigen::Vector3d beam = (end - scan.origin).cast<double>() + random_.vector(0.2);
      if (beam.allFinite() && beam.norm() > 0.01) return {originOf(scan), beam.normalized()};
    }
    throw std::runtime_error(
        "the scans have hardly any finite points: there are no rays to measure with");
  }

  Random random_;
  const Grid& grid_;
  const std::vector<Scan>& scans_;
  std::int32_t edge_cells_;
  CellBox bounds_;
  std::vector<CellBox> surfaces_;
};

/// Appends an answer for each query until the time is up, which warms up; then times the same queries.
/// @return Queries per second of CPU time.
template <typename QueryT, typename AnswerT, typename AskT>
double askEach(const std::vector<QueryT>& queries, double min_cpu_s, std::vector<AnswerT>& answers,
               AskT ask) {
  constexpr std::size_t kQueriesPerLook = 16;
  using Clock = std::chrono::steady_clock;
  answers.reserve(queries.size());
  const auto deadline = Clock::now() + std::chrono::duration<double>(kTimeForQueries_s);
  for (const QueryT& query : queries) {
    answers.push_back(ask(query));
    if (answers.size() % kQueriesPerLook == 0 && Clock::now() > deadline) break;
  }
  double cpu_s = 0.0;
  double num_asked = 0.0;
  do {
    cpu_s += timeOf([&] {
               for (std::size_t i = 0; i < answers.size(); ++i) answers[i] = ask(queries[i]);
             }).cpu_s;
    num_asked += static_cast<double>(answers.size());
  } while (cpu_s < min_cpu_s);
  return num_asked / cpu_s;
}

template <typename AnswerT, typename IsSameT>
Differences compareLists(const std::vector<AnswerT>& a, const std::vector<AnswerT>& b,
                         IsSameT is_same) {
  Differences differences;
  differences.compared = std::min(a.size(), b.size());
  for (std::size_t i = 0; i < differences.compared; ++i) {
    if (!is_same(a[i], b[i])) ++differences.different;
  }
  return differences;
}

}  // namespace

ByPlace<QuerySet> makeQueries(const CuboidMap& map, const std::vector<Scan>& scans) {
  QueryMaker maker(map, scans);
  ByPlace<QuerySet> queries;
  queries.uniform = maker.makeUniform();
  queries.near_surface = maker.makeNearSurface();
  return queries;
}

QueryRun askQueries(const MapAdapter& map, const QuerySet& queries, double min_cpu_s) {
  QueryRun run;
  if (map.offers(QueryKind::kPoint)) {
    run.rates.points_per_s =
        askEach(queries.points_map, min_cpu_s, run.answers.points,
                [&map](const Eigen::Vector3d& point) { return map.classifyPoint(point); });
  }
  if (map.offers(QueryKind::kBox)) {
    run.rates.boxes_per_s =
        askEach(queries.boxes, min_cpu_s, run.answers.boxes,
                [&map](const CellBox& box) { return static_cast<char>(map.isAnyOccupied(box)); });
  }
  if (map.offers(QueryKind::kRay)) {
    run.rates.rays_per_s =
        askEach(queries.rays, min_cpu_s, run.answers.rays_m,
                [&map](const RayQuery& ray) { return map.castRay(ray).value_or(kRayRange_m); });
  }
  return run;
}

AnswerDifferences compareAnswers(const QueryAnswers& a, const QueryAnswers& b,
                                 double resolution_m) {
  AnswerDifferences differences;
  differences.points = compareLists(a.points, b.points, std::equal_to<>());
  differences.boxes = compareLists(a.boxes, b.boxes, std::equal_to<>());
  differences.rays = compareLists(a.rays_m, b.rays_m, [resolution_m](double x, double y) {
    return std::abs(x - y) <= 2.0 * resolution_m;
  });
  return differences;
}

}  // namespace cuboid_mapping::bench
