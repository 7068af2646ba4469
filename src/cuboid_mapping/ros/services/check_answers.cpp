// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/services/check_answers.h"

#include "cuboid_mapping/query/box_query.h"
#include "cuboid_mapping/query/path_query.h"
#include "cuboid_mapping/query/ray_query.h"
#include "cuboid_mapping/query/value_query.h"
#include "cuboid_mapping/ros/services/limited_answer.h"
#include "cuboid_mapping/ros/services/request_reader.h"

#include <limits>
#include <numeric>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::Budget;
using cuboid_mapping::CastRays;
using cuboid_mapping::CellBox;
using cuboid_mapping::CheckBoxes;
using cuboid_mapping::CheckPath;
using cuboid_mapping::CuboidFilter;
using cuboid_mapping::CuboidMap;
using cuboid_mapping::CuboidOutput;
using cuboid_mapping::MetricBox;
using cuboid_mapping::Occupancy;
using cuboid_mapping::RayEnd;
using cuboid_mapping::UnknownPolicy;

static_assert(CheckBoxes::Response::OCCUPIED == static_cast<int>(Occupancy::kOccupied));
static_assert(CheckBoxes::Response::FREE == static_cast<int>(Occupancy::kFree));
static_assert(CheckPath::Response::OCCUPIED == static_cast<int>(Occupancy::kOccupied));
static_assert(CheckPath::Response::FREE == static_cast<int>(Occupancy::kFree));

using Path = std::vector<Eigen::Vector3d>;

// Of the answer to each entry.
constexpr std::size_t kBoxBytes = 30;
constexpr std::size_t kPathBytes = 46;
constexpr std::size_t kRayBytes = 49;

/// For boxes that are not answered: in the way.
void fill(std::size_t num_boxes, CheckBoxes::Response& response) {
  response.blocked.assign(num_boxes, static_cast<std::uint8_t>(true));
  response.occupancy.assign(num_boxes, CheckBoxes::Response::UNKNOWN);
  response.free_volume.assign(num_boxes, 0.0);
  response.occupied_volume.assign(num_boxes, 0.0);
  response.unknown_volume.assign(num_boxes, 0.0);
  response.max_probability.assign(num_boxes, std::numeric_limits<float>::quiet_NaN());
}

/// A box of a request.
struct AskedBox {
  std::size_t number;
  CellBox box;
  UnknownPolicy policy;
};

void answer(const CuboidMap& map, const AskedBox& asked, Budget& budget,
            CheckBoxes::Response& response) {
  const cuboid_mapping::BoxQueryResult result =
      queryBox(map, asked.box, CuboidOutput::kNone, CuboidFilter::kAll, budget);
  const auto log_odds = maxLogOdds(map, asked.box, budget);
  if (budget.isSpent()) return;
  const Occupancy occupancy = result.occupancy();
  const bool is_blocked =
      occupancy == Occupancy::kOccupied ||
      (occupancy == Occupancy::kUnknown && asked.policy == UnknownPolicy::kStop);
  const std::size_t i = asked.number;
  response.blocked[i] = static_cast<std::uint8_t>(is_blocked);
  response.occupancy[i] = static_cast<std::uint8_t>(occupancy);
  response.free_volume[i] = result.free_volume_m3;
  response.occupied_volume[i] = result.occupied_volume_m3;
  response.unknown_volume[i] = result.unknown_volume_m3;
  if (log_odds) {
    response.max_probability[i] = static_cast<float>(cuboid_mapping::toProbability(*log_odds));
  }
}

/// The paths of a request, one by one.
std::vector<Path> splitPaths(RequestReader& reader, const CheckPath::Request& request) {
  reader.requireFew(request.waypoints.size(), "waypoints", kPathBytes);
  const Path all = reader.points(request.waypoints, "waypoints");
  reader.require(!all.empty(), "there are no waypoints: give at least one");
  reader.requireFew(request.lengths.size(), "paths", kPathBytes);
  std::vector<std::uint32_t> lengths = request.lengths;
  if (lengths.empty()) lengths.push_back(static_cast<std::uint32_t>(all.size()));
  const auto total = std::accumulate(lengths.begin(), lengths.end(), std::uint64_t{0});
  reader.require(total == all.size(), "lengths add up to " + std::to_string(total) +
                                          ", but there are " + std::to_string(all.size()) +
                                          " waypoints");
  std::vector<Path> paths;
  if (!reader.isGood()) return paths;
  auto first = all.begin();
  for (const std::uint32_t length : lengths) {
    reader.require(length > 0,
                   [] { return "lengths: every path must have at least one waypoint"; });
    paths.emplace_back(first, first + length);
    first += length;
  }
  return paths;
}

/// For paths that are not answered: blocked where they begin.
void fill(const std::vector<Path>& paths, CheckPath::Response& response) {
  response.free.assign(paths.size(), static_cast<std::uint8_t>(false));
  response.segment.assign(paths.size(), 0);
  response.occupancy.assign(paths.size(), CheckPath::Response::UNKNOWN);
  response.free_length.assign(paths.size(), 0.0);
  response.length.assign(paths.size(), 0.0);
  for (const Path& path : paths) response.point.push_back(toPoint(path.front()));
}

/// A path of a request.
struct AskedPath {
  std::size_t number;
  const Path& path;
  Eigen::Vector3d size_m;
  UnknownPolicy policy;
};

void answer(const CuboidMap& map, const AskedPath& asked, Budget& budget,
            CheckPath::Response& response) {
  const auto result = checkPath(map, asked.path, asked.size_m, asked.policy, budget);
  if (budget.isSpent()) return;
  const std::size_t i = asked.number;
  const auto& contact = result.contact;
  const Occupancy occupancy = contact ? map.voxels().at(contact->voxel) : Occupancy::kFree;
  response.free[i] = static_cast<std::uint8_t>(!contact);
  response.segment[i] = contact ? static_cast<std::int32_t>(contact->segment) : -1;
  response.point[i] = toPoint(contact ? contact->point_map : asked.path.back());
  response.occupancy[i] = static_cast<std::uint8_t>(occupancy);
  response.free_length[i] = contact ? contact->distance_m : result.length_m;
  response.length[i] = result.length_m;
}

struct Ray {
  Eigen::Vector3d origin_map;
  Eigen::Vector3d direction_map;  ///< Length 1.
};

/// What is asked of every ray.
struct RayLimits {
  double max_range_m;
  double inflation_m;
  UnknownPolicy policy;

  [[nodiscard]] Eigen::Vector3d thickness_m() const {
    return Eigen::Vector3d::Constant(2.0 * inflation_m);
  }
};

std::uint8_t toMessage(RayEnd end) {
  switch (end) {
    case RayEnd::kOccupied: return CastRays::Request::END_OCCUPIED;
    case RayEnd::kUnknown: return CastRays::Request::END_UNKNOWN;
    default: return CastRays::Request::END_MAX_RANGE;
  }
}

/// For rays that are not answered: they end where they begin.
void fill(const std::vector<Ray>& rays, CastRays::Response& response) {
  response.end.assign(rays.size(), CastRays::Request::END_UNKNOWN);
  response.distance.assign(rays.size(), 0.0);
  response.first_unknown.assign(rays.size(), 0.0);
  response.unknown_length.assign(rays.size(), 0.0);
  for (const Ray& ray : rays) response.point.push_back(toPoint(ray.origin_map));
}

/// A ray of a request.
struct AskedRay {
  std::size_t number;
  const Ray& ray;
  const RayLimits& limits;
};

void answer(const CuboidMap& map, const AskedRay& asked, Budget& budget,
            CastRays::Response& response) {
  const Ray& ray = asked.ray;
  const RayLimits& limits = asked.limits;
  RayEnd end = RayEnd::kMaxRange;
  double range_m = limits.max_range_m;
  if (limits.inflation_m > 0.0) {
    const Path path{ray.origin_map, ray.origin_map + range_m * ray.direction_map};
    const auto swept = checkPath(map, path, limits.thickness_m(), limits.policy, budget);
    if (swept.contact) {
      range_m = swept.contact->distance_m;
      const Occupancy met = map.voxels().at(swept.contact->voxel);
      end = met == Occupancy::kOccupied ? RayEnd::kOccupied : RayEnd::kUnknown;
    }
  }
  // The line in the middle; nothing is left of it when the thick ray is blocked from the start.
  const auto line = range_m > 0.0 ? castRay(map, ray.origin_map, ray.direction_map, range_m,
                                            limits.policy, budget)
                                  : std::nullopt;
  if (budget.isSpent()) return;
  if (line && line->end != RayEnd::kMaxRange) {
    end = line->end;
    range_m = line->distance_m;
  }
  constexpr double kNever = std::numeric_limits<double>::infinity();
  const std::size_t i = asked.number;
  response.end[i] = toMessage(end);
  response.distance[i] = range_m;
  response.point[i] = toPoint(ray.origin_map + range_m * ray.direction_map);
  response.first_unknown[i] = line ? line->first_unknown_m.value_or(kNever) : kNever;
  response.unknown_length[i] = line ? line->unknown_length_m : 0.0;
}

std::vector<Ray> readRays(RequestReader& reader, const CastRays::Request& request) {
  reader.require(request.origins.size() == request.directions.size(),
                 "origins has " + std::to_string(request.origins.size()) + " points, directions " +
                     std::to_string(request.directions.size()) +
                     ": give one of each for every ray");
  std::vector<Ray> rays;
  for (std::size_t i = 0; reader.isGood() && i < request.origins.size(); ++i) {
    rays.push_back({reader.point(request.origins[i], {"origins", i}),
                    reader.direction(request.directions[i], {"directions", i})});
    rays.back().direction_map.stableNormalize();
  }
  return rays;
}

}  // namespace

CheckBoxes::Response answerCheckBoxes(const MapInFrame& map, const CheckBoxes::Request& request) {
  RequestReader reader(map, request.header);
  const UnknownPolicy policy = reader.policy(request.unknown);
  reader.requireFew(request.min.size(), "boxes", kBoxBytes);
  const std::vector<CellBox> boxes = reader.boxes(request.min, request.max, request.inflation);
  if (!reader.isGood()) return refuse<CheckBoxes::Response>(reader.error());
  CheckBoxes::Response response;
  fill(boxes.size(), response);
  readWithin(map, kBoxBytes, [&](const CuboidMap& content, const ros::Time& stamp, Budget& budget) {
    fillHead(map, content, stamp, response);
    answerEach(map, boxes.size(), "boxes", budget, response, [&](std::size_t i) {
      answer(content, {i, boxes[i], policy}, budget, response);
    });
  });
  return response;
}

CheckPath::Response answerCheckPath(const MapInFrame& map, const CheckPath::Request& request) {
  RequestReader reader(map, request.header);
  const UnknownPolicy policy = reader.policy(request.unknown);
  const Eigen::Vector3d size_m = reader.size(request.size, request.inflation);
  const std::vector<Path> paths = splitPaths(reader, request);
  for (const Path& path : paths) {
    for (std::size_t i = 0; i < path.size(); ++i) {  // Each with the way to it.
      MetricBox box = cuboid_mapping::boxAround(path[i], size_m);
      const MetricBox before = cuboid_mapping::boxAround(path[i == 0 ? i : i - 1], size_m);
      box.min_m = box.min_m.cwiseMin(before.min_m);
      box.max_m = box.max_m.cwiseMax(before.max_m);
      (void)reader.cells(box);
    }
  }
  if (!reader.isGood()) return refuse<CheckPath::Response>(reader.error());
  CheckPath::Response response;
  fill(paths, response);
  readWithin(map, kPathBytes,
             [&](const CuboidMap& content, const ros::Time& stamp, Budget& budget) {
               fillHead(map, content, stamp, response);
               answerEach(map, paths.size(), "paths", budget, response, [&](std::size_t i) {
                 answer(content, {i, paths[i], size_m, policy}, budget, response);
               });
             });
  return response;
}

CastRays::Response answerCastRays(const MapInFrame& map, const CastRays::Request& request) {
  RequestReader reader(map, request.header);
  const RayLimits limits{reader.notNegative(request.max_range, "max_range"),
                         reader.notNegative(request.inflation, "inflation"),
                         reader.policy(request.unknown)};
  reader.require(limits.max_range_m > 0.0, "max_range is 0: it must be greater than 0");
  reader.requireFew(request.origins.size(), "rays", kRayBytes);
  const std::vector<Ray> rays = readRays(reader, request);
  const Eigen::Vector3d half_m = 0.5 * limits.thickness_m().array() + map.map.grid().resolution();
  for (std::size_t i = 0; reader.isGood() && i < rays.size(); ++i) {
    const Ray& ray = rays[i];
    const Eigen::Vector3d end = ray.origin_map + limits.max_range_m * ray.direction_map;
    (void)reader.cells(
        {ray.origin_map.cwiseMin(end) - half_m, ray.origin_map.cwiseMax(end) + half_m});
  }
  if (!reader.isGood()) return refuse<CastRays::Response>(reader.error());
  CastRays::Response response;
  fill(rays, response);
  readWithin(map, kRayBytes, [&](const CuboidMap& content, const ros::Time& stamp, Budget& budget) {
    fillHead(map, content, stamp, response);
    answerEach(map, rays.size(), "rays", budget, response, [&](std::size_t i) {
      answer(content, {i, rays[i], limits}, budget, response);
    });
  });
  return response;
}

}  // namespace cuboid_mapping_ros
