// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/ground/ground_step.h"

#include "cuboid_mapping/scan/scan_filter.h"

#include <pcl/console/print.h>
#include <pcl/point_types.h>
#include <pcl/sample_consensus/ransac.h>
#include <pcl/sample_consensus/sac_model_perpendicular_plane.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <mutex>
#include <numeric>
#include <utility>

namespace cuboid_mapping_ros {
namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZ>;

/// Minimum number of points for a plane, as in octomap_server.
constexpr std::size_t kMinPoints = 50;
/// Minimum number of remaining points for the search for a further plane.
constexpr std::size_t kMinPointsLeft = 10;

Cloud transformCloud(const std::vector<Eigen::Vector3f>& points_cloud,
                     const Eigen::Isometry3d& T_base_cloud) {
  Cloud cloud;
  cloud.reserve(points_cloud.size());
  for (const Eigen::Vector3f& point : points_cloud) {
    const Eigen::Vector3f point_base = (T_base_cloud * point.cast<double>()).cast<float>();
    cloud.push_back(pcl::PointXYZ(point_base.x(), point_base.y(), point_base.z()));
  }
  return cloud;
}

/// Stops PCL from printing a message for every plane that it does not find. One search at a time: of two nodelets, the
/// second would restore the silence of the first.
class Silence {
 public:
  Silence() { pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS); }
  ~Silence() { pcl::console::setVerbosityLevel(level_); }
  Silence(const Silence&) = delete;
  Silence& operator=(const Silence&) = delete;

 private:
  static inline std::mutex mutex;
  std::lock_guard<std::mutex> lock_{mutex};
  pcl::console::VERBOSITY_LEVEL level_ = pcl::console::getVerbosityLevel();
};

/// Searches level planes among the points that are in no plane yet.
///
/// Does what pcl::SACSegmentation does, without its library, which takes 0.2 s to load at each
/// start of a program.
class PlaneSearch {
 public:
  PlaneSearch(const Cloud& points_base, const GroundFilterConfig& config)
      : config_(config), input_(new Cloud(points_base)), left_(input_->size()) {
    std::iota(left_.begin(), left_.end(), 0);
  }

  /// Points of the ground's plane; none if there is no such plane.
  std::vector<int> findGround() {
    const Silence silence;
    while (left_.size() > kMinPointsLeft) {
      Eigen::VectorXf plane;
      std::vector<int> inliers = findPlane(plane);
      if (inliers.empty()) break;
      if (std::abs(plane[3]) < config_.plane_distance_m) return inliers;
      removeFromLeft(inliers);
    }
    return {};
  }

 private:
  using Model = pcl::SampleConsensusModelPerpendicularPlane<pcl::PointXYZ>;

  /// A level plane of the points that are left. @return Its points; none if there is no such plane.
  std::vector<int> findPlane(Eigen::VectorXf& plane) const {
    const Model::Ptr model(new Model(input_, left_));  // the same random numbers every time
    model->setAxis(Eigen::Vector3f::UnitZ());
    model->setEpsAngle(config_.angle_rad);
    pcl::RandomSampleConsensus<pcl::PointXYZ> search(model, config_.distance_m);
    search.setMaxIterations(200);
    if (!search.computeModel()) return {};
    std::vector<int> inliers;
    search.getInliers(inliers);
    Eigen::VectorXf coarse_plane;
    search.getModelCoefficients(coarse_plane);
    model->optimizeModelCoefficients(inliers, coarse_plane, plane);
    model->selectWithinDistance(plane, config_.distance_m, inliers);
    return inliers;
  }

  void removeFromLeft(const std::vector<int>& indices) {
    std::vector<bool> is_removed(input_->size(), false);
    for (const int index : indices) is_removed[static_cast<std::size_t>(index)] = true;
    std::vector<int> rest;
    for (const int index : left_) {
      if (!is_removed[static_cast<std::size_t>(index)]) rest.push_back(index);
    }
    left_.swap(rest);
  }

  GroundFilterConfig config_;
  Cloud::Ptr input_;
  std::vector<int> left_;
};

}  // namespace

GroundSplit splitGround(const std::vector<Eigen::Vector3f>& points_cloud,
                        const Eigen::Isometry3d& T_base_cloud, const GroundFilterConfig& config) {
  GroundSplit split;
  if (points_cloud.size() < kMinPoints) {
    split.others = points_cloud;
    return split;
  }
  const Cloud points_base = transformCloud(points_cloud, T_base_cloud);
  std::vector<bool> is_ground(points_cloud.size(), false);
  for (const int index : PlaneSearch(points_base, config).findGround()) {
    is_ground[static_cast<std::size_t>(index)] = true;
    split.is_plane_found = true;
  }
  for (std::size_t i = 0; i < points_cloud.size(); ++i) {
    if (!split.is_plane_found) is_ground[i] = std::abs(points_base[i].z) < config.plane_distance_m;
    (is_ground[i] ? split.ground : split.others).push_back(points_cloud[i]);
  }
  return split;
}

std::vector<ParameterDeclaration> GroundStep::declare() {
  using P = NodeParameters;
  using S = SourceParameters;
  return {
      {"base_frame_id", "", frame(&P::base_frame_id, false),
       "Frame of the robot with z = 0 on the ground. Used by filter_ground and start_free."},
      {"filter_ground", "", adjustable(boolean(&S::filter_ground)),
       "true: points on the ground are no obstacles, but their beams clear space."},
      {"ground_filter/distance", "m",
       adjustable(number(&GroundFilterConfig::distance_m, 0.001, 1.0)),
       "Points closer to the ground plane than this belong to the ground."},
      {"ground_filter/angle", "rad",
       adjustable(number(&GroundFilterConfig::angle_rad, 0.001, 15.0)),
       "Largest angle between the ground plane and the xy plane of base_frame_id."},
      {"ground_filter/plane_distance", "m",
       adjustable(number(&GroundFilterConfig::plane_distance_m, 0.001, 1.0)),
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
