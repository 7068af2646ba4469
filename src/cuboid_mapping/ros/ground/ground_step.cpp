// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/ground/ground_step.h"

#include "cuboid_mapping/scan/scan_filter.h"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <numeric>
#include <optional>
#include <random>
#include <utility>

namespace cuboid_mapping_ros {
namespace {

/// Minimum number of points for a plane, as in octomap_server.
constexpr std::size_t kMinPoints = 50;
/// Minimum number of remaining points for the search for a further plane.
constexpr Eigen::Index kMinPointsLeft = 10;
constexpr double kMaxTries = 200.0;

/// A point in each row; each axis is in one piece of memory, for the loop over all distances.
using Points = Eigen::ArrayX3f;
using Plane = Eigen::Hyperplane<float, 3>;
using Indices = std::vector<Eigen::Index>;

Points transformPoints(const std::vector<Eigen::Vector3f>& points_cloud,
                       const Eigen::Isometry3d& T_base_cloud) {
  Points points_base(points_cloud.size(), 3);
  for (Eigen::Index i = 0; i < points_base.rows(); ++i) {
    const Eigen::Vector3d point = points_cloud[static_cast<std::size_t>(i)].cast<double>();
    points_base.row(i) = (T_base_cloud * point).cast<float>().transpose();
  }
  return points_base;
}

/// Searches level planes (RANSAC) among the points that are in no plane yet.
///
/// PCL's search prints an error for each cloud without a plane, and can only be silenced for the whole process, in which
/// other nodelets may use PCL.
class PlaneSearch {
 public:
  PlaneSearch(Points points_base, const GroundFilterConfig& config)
      : config_(config),
        left_(std::move(points_base)),
        ids_(static_cast<std::size_t>(left_.rows())) {
    std::iota(ids_.begin(), ids_.end(), 0);
  }

  /// Points of the ground's plane; none if there is no such plane.
  Indices findGround() {
    while (left_.rows() > kMinPointsLeft) {
      const auto plane = findPlane();
      if (!plane) break;
      Indices inliers = takeOut(*plane);
      if (inliers.empty()) break;
      if (std::abs(plane->offset()) < config_.plane_distance_m) return inliers;
    }
    return {};
  }

 private:
  [[nodiscard]] Eigen::Array<bool, Eigen::Dynamic, 1> isNear(const Plane& plane) const {
    const Eigen::Vector3f& n = plane.normal();
    return (left_.col(0) * n.x() + left_.col(1) * n.y() + left_.col(2) * n.z() + plane.offset())
               .abs() <= static_cast<float>(config_.distance_m);
  }

  /// Also false for the normal 0 of points in a line.
  [[nodiscard]] bool isLevel(const Eigen::Vector3f& normal) const {
    return normal.norm() > 0.0F &&
           std::acos(std::abs(normal.normalized().z())) <= config_.angle_rad;
  }

  /// A level plane of many of the points that are left.
  [[nodiscard]] std::optional<Plane> findPlane() const {
    std::mt19937 random;  // The same numbers every time.
    const auto draw = [&]() -> Eigen::Vector3f {
      return left_.row(random() % static_cast<std::uint32_t>(left_.rows())).matrix().transpose();
    };
    std::optional<Plane> best;
    Eigen::Index most = 0;
    double tries = kMaxTries;
    for (int i = 0; i < tries; ++i) {
      const Eigen::Vector3f point = draw();
      const Eigen::Vector3f normal = (draw() - point).cross(draw() - point);
      if (!isLevel(normal)) continue;
      const Plane plane(normal.normalized(), point);
      const Eigen::Index count = isNear(plane).count();
      if (count <= most) continue;
      best = plane;
      most = count;
      // So many draw three points of this plane at least once, with a probability of 99 %.
      const double share = static_cast<double>(count) / static_cast<double>(left_.rows());
      tries = std::min(kMaxTries, std::log(0.01) / std::log1p(-std::pow(share, 3)));
    }
    return best ? fit(*best) : std::nullopt;
  }

  /// The plane through the points near a plane, if it is level.
  [[nodiscard]] std::optional<Plane> fit(const Plane& plane) const {
    const Eigen::ArrayXf weights = isNear(plane).cast<float>();
    const Eigen::Vector3f mean =
        (left_.colwise() * weights).colwise().sum().transpose() / weights.sum();
    const Eigen::MatrixX3f apart = left_.matrix().rowwise() - mean.transpose();
    const Eigen::Matrix3f scatter = apart.transpose() * weights.matrix().asDiagonal() * apart;
    const Eigen::Vector3f normal =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix3f>(scatter).eigenvectors().col(0);
    return isLevel(normal) ? std::optional(Plane(normal, mean)) : std::nullopt;
  }

  /// Takes the points near a plane out of the rest.
  Indices takeOut(const Plane& plane) {
    const auto is_near = isNear(plane);
    Indices taken;
    Eigen::Index num_left = 0;
    for (Eigen::Index i = 0; i < left_.rows(); ++i) {
      const Eigen::Index id = ids_[static_cast<std::size_t>(i)];
      if (is_near[i]) {
        taken.push_back(id);
        continue;
      }
      ids_[static_cast<std::size_t>(num_left)] = id;
      left_.row(num_left++) = left_.row(i).eval();
    }
    left_.conservativeResize(num_left, 3);
    return taken;
  }

  GroundFilterConfig config_;
  Points left_;
  Indices ids_;  ///< Of the rows of left_.
};

}  // namespace

GroundSplit splitGround(const std::vector<Eigen::Vector3f>& points_cloud,
                        const Eigen::Isometry3d& T_base_cloud, const GroundFilterConfig& config) {
  GroundSplit split;
  if (points_cloud.size() < kMinPoints) {
    split.others = points_cloud;
    return split;
  }
  const Points points_base = transformPoints(points_cloud, T_base_cloud);
  std::vector<bool> is_ground(points_cloud.size(), false);
  for (const Eigen::Index index : PlaneSearch(points_base, config).findGround()) {
    is_ground[static_cast<std::size_t>(index)] = true;
    split.is_plane_found = true;
  }
  for (std::size_t i = 0; i < points_cloud.size(); ++i) {
    const float height_m = points_base(static_cast<Eigen::Index>(i), 2);
    if (!split.is_plane_found) is_ground[i] = std::abs(height_m) < config.plane_distance_m;
    (is_ground[i] ? split.ground : split.others).push_back(points_cloud[i]);
  }
  return split;
}

std::vector<ParameterDeclaration> GroundStep::declare() {
  using O = OctomapServerParameters;
  using P = NodeParameters;
  using S = SourceParameters;
  return {
      {"base_frame_id", "", frame({&P::octomap_server, &O::base_frame_id}, false),
       "Frame of the robot with z = 0 on the ground. Used by filter_ground and start_free."},
      {"filter_ground", "", boolean(&S::filter_ground),
       "true: points on the ground are no obstacles, but their beams clear space."},
      {"ground_filter/distance", "m",
       number({&S::ground_filter, &GroundFilterConfig::distance_m}, 0.001, 1.0),
       "Points closer to the ground plane than this belong to the ground."},
      {"ground_filter/angle", "rad",
       number({&S::ground_filter, &GroundFilterConfig::angle_rad}, 0.001, 15.0),
       "Largest angle between the ground plane and the xy plane of base_frame_id."},
      {"ground_filter/plane_distance", "m",
       number({&S::ground_filter, &GroundFilterConfig::plane_distance_m}, 0.001, 1.0),
       "Largest height of the ground plane above or below z = 0 of base_frame_id."},
  };
}

void GroundStep::apply(SensorPart& part, const StepPoses& poses, CloudFigures& figures) const {
  std::vector<Eigen::Vector3f>& points = part.points.points;
  const Eigen::Isometry3d T_base_points =
      poses.at(0).inverse() * part.T_map_cloud * Eigen::Translation3d(part.points.anchor_cloud);
  // As octomap_server: points outside the limits do not take part in the search for the ground.
  const auto is_outside = [&](const Eigen::Vector3f& point) {
    return !isInside(crop_base_, T_base_points * point.cast<double>());
  };
  const auto end = std::remove_if(points.begin(), points.end(), is_outside);
  figures.num_filtered += static_cast<std::uint64_t>(std::distance(end, points.end()));
  points.erase(end, points.end());
  GroundSplit split = splitGround(points, T_base_points, config_);
  points = std::move(split.others);
  part.open_ends = std::move(split.ground);
}

}  // namespace cuboid_mapping_ros
