// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/lidar.h"

#include "simulation/range_check.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <random>
#include <utility>

namespace cuboid_mapping {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr double kNoiseCutOff = 3.0;

/// A solid, prepared for many beams from one place.
struct Target {
  MetricBox bounds;
  double nearest_m;  ///< Minimum range at which a beam meets it.
  const Solid* solid;
};

std::vector<Target> computeTargets(const std::vector<Solid>& solids,
                                   const Eigen::Vector3d& origin_map, double max_range_m) {
  std::vector<Target> targets;
  targets.reserve(solids.size());
  for (const Solid& solid : solids) {
    const MetricBox bounds = computeBounds(solid.shape);
    const double nearest = std::max(0.0, computeSignedDistance(bounds, origin_map));
    if (nearest <= max_range_m) targets.push_back({bounds, nearest, &solid});
  }
  std::sort(targets.begin(), targets.end(),
            [](const Target& a, const Target& b) { return a.nearest_m < b.nearest_m; });
  return targets;
}

struct Hit {
  double range_m = kNever;
  const Solid* solid = nullptr;
};

/// The first solid on the beam. Targets are sorted by distance, so that most are skipped.
Hit findHit(const std::vector<Target>& targets, const Beam& beam) {
  Hit hit;
  for (const Target& target : targets) {
    if (target.nearest_m >= hit.range_m) break;
    double range = computeRange(target.bounds, beam);
    if (range >= hit.range_m) continue;
    if (!std::holds_alternative<MetricBox>(target.solid->shape)) {
      range = computeRange(target.solid->shape, beam);
    }
    if (range < hit.range_m) hit = {range, target.solid};
  }
  return hit;
}

/// Beams of a spinning lidar.
std::vector<Eigen::Vector3d> makeDirections(const LidarConfig& config) {
  const double step =
      (config.max_elevation_rad - config.min_elevation_rad) / std::max(1, config.rings - 1);
  std::vector<Eigen::Vector3d> directions;
  directions.reserve(static_cast<std::size_t>(config.rings) * config.columns);
  for (int ring = 0; ring < config.rings; ++ring) {
    const double elevation = config.max_elevation_rad - ring * step;
    for (int column = 0; column < config.columns; ++column) {
      const double azimuth = 2 * M_PI * column / config.columns;
      directions.emplace_back(std::cos(elevation) * std::cos(azimuth),
                              std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
    }
  }
  return directions;
}

}  // namespace

std::vector<std::string> checkLidarConfig(const LidarConfig& config) {
  RangeCheck check;
  check("rings", config.rings, 1, 1024);
  check("columns", config.columns, 1, 100000);
  check("min_elevation", config.min_elevation_rad, -M_PI_2, M_PI_2);
  check("max_elevation", config.max_elevation_rad, config.min_elevation_rad, M_PI_2);
  check("max_range", config.max_range_m, 0.1, 1000.0);
  check("noise", config.range_noise_m, 0.0, 1.0);
  return check.errors();
}

Lidar::Lidar(const LidarConfig& config) : Lidar(config, makeDirections(config)) {}

Lidar::Lidar(const LidarConfig& config, std::vector<Eigen::Vector3d> directions)
    : config_(config), directions_lidar_(std::move(directions)) {
  assert(checkLidarConfig(config).empty());
  assert(directions_lidar_.size() == static_cast<std::size_t>(config.rings) * config.columns);
}

LidarCloud Lidar::computeCloud(const std::vector<Solid>& solids,
                               const Eigen::Isometry3d& T_map_lidar, std::uint64_t number) const {
  const Eigen::Vector3d origin = T_map_lidar.translation();
  const std::vector<Target> targets = computeTargets(solids, origin, config_.max_range_m);
  std::seed_seq seeds{config_.seed, config_.seed >> 32, number, number >> 32};
  std::mt19937_64 generator(seeds);
  std::normal_distribution<double> normal;

  LidarCloud cloud{config_.rings, config_.columns, {}};
  cloud.points.reserve(directions_lidar_.size());
  for (const Eigen::Vector3d& direction : directions_lidar_) {
    const Hit hit = findHit(targets, Beam(origin, T_map_lidar.linear() * direction));
    if (hit.range_m > config_.max_range_m) {
      constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
      cloud.points.push_back({kNan, kNan, kNan, 0.0F});
      continue;
    }
    const double noise = std::clamp(normal(generator), -kNoiseCutOff, kNoiseCutOff);
    const double range = std::max(0.0, hit.range_m + config_.range_noise_m * noise);
    const Eigen::Vector3f point = (direction * range).cast<float>();
    cloud.points.push_back({point.x(), point.y(), point.z(), computeReflectivity(hit.solid->kind)});
  }
  return cloud;
}

}  // namespace cuboid_mapping
