// SPDX-License-Identifier: BSD-3-Clause
#include "frontier_layer.h"

#include "cuboid_mapping/geometry/box_faces.h"

#include <rviz/properties/int_property.h>
#include <rviz/properties/vector_property.h>

#include <OgreSceneManager.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace cuboid_mapping_rviz {
namespace {

using namespace cuboid_mapping;
using rviz::PointCloud;

/// Time limit of the computation.
constexpr double kMaxTime_s = 2.0;
/// Edges of the boxes that stand for voxels, in voxels: gaps between them let one see through.
constexpr double kShownEdge = 0.5;

Ogre::Vector3 toOgre(const Eigen::Vector3d& vector) {
  return {static_cast<float>(vector.x()), static_cast<float>(vector.y()),
          static_cast<float>(vector.z())};
}

/// Colour by place: it stays when other frontiers appear and vanish.
Ogre::ColourValue colorOf(const Frontier& frontier) {
  const double turns = frontier.center_map.dot(Eigen::Vector3d(0.11, 0.23, 0.37));
  Ogre::ColourValue color;
  color.setHSB(static_cast<float>(turns - std::floor(turns)), 0.9F, 1.0F);
  return color;
}

CellBox inflate(const CellBox& box, double margin_m, const Grid& grid) {
  const double voxels = std::min(margin_m * grid.inverseResolution(), 1.0 * kViewedEdge);
  const auto by = static_cast<std::int32_t>(voxels) + 1;
  return dilate(box, {by, by, by});
}

FrontierPicture findAndDraw(const CuboidMap& map, const FrontierTask& task,
                            const std::atomic<bool>& is_stopped) {
  if (task.region.isEmpty()) return {};
  QueryLimits limits;
  limits.time_s = kMaxTime_s;
  MapUnlock turns;
  turns.is_stopped = &is_stopped;
  Budget budget(limits, turns);
  const auto found = findFrontiers(map, task, budget);
  if (!found.fault.empty()) throw std::invalid_argument("Robot: " + found.fault);
  FrontierPicture picture =
      drawFrontiers(map.grid(), found.value, map.grid().toMetricBox(task.region).min_m);
  picture.is_complete = found.status != AnswerStatus::kBudgetSpent;
  return picture;
}

}  // namespace

FrontierPicture drawFrontiers(const Grid& grid, const std::vector<Frontier>& frontiers,
                              const Eigen::Vector3d& corner_map) {
  FrontierPicture picture;
  picture.corner = toOgre(corner_map);
  picture.num_clusters = frontiers.size();
  for (const Frontier& frontier : frontiers) {
    const Ogre::ColourValue color = colorOf(frontier);
    for (const Cell& cell : frontier.voxels) {
      const Eigen::Vector3d center_map = grid.centerOf(CellBox::ofCell(cell));
      picture.voxels.push_back({toOgre(center_map - corner_map), color});
    }
    if (!frontier.place_map) continue;
    picture.places.push_back({toOgre(*frontier.place_map - corner_map), color});
  }
  return picture;
}

ScenePoints::ScenePoints(Ogre::SceneNode& parent, PointCloud::RenderMode mode)
    : node_(*parent.createChildSceneNode()) {
  cloud_.setRenderMode(mode);
  node_.attachObject(&cloud_);
}

ScenePoints::~ScenePoints() {
  node_.detachAllObjects();
  node_.getCreator()->destroySceneNode(&node_);
}

void ScenePoints::show(FrontierPicture::Points points, const Ogre::Vector3& corner, float size_m) {
  cloud_.clear();
  cloud_.setDimensions(size_m, size_m, size_m);
  if (!points.empty()) cloud_.addPoints(points.data(), static_cast<std::uint32_t>(points.size()));
  node_.setPosition(corner);
}

// NOLINTBEGIN(cppcoreguidelines-owning-memory): rviz deletes properties with their display
FrontierLayer::FrontierLayer(rviz::Display& display)
    : MapLayer(
          display, "Frontier clusters",
          "Show clusters of free voxels beside unknown ones, each with a sphere at the place "
          "nearest to its middle where the robot fits, up to 2 m away: 512 x 512 voxels around "
          "the viewed place."),
      robot_property_(new rviz::VectorProperty("Robot", Ogre::Vector3(0.5F),
                                               "Edges of the robot, in m.", shownProperty())),
      least_property_(new rviz::IntProperty("Least voxels", 20, "Smaller clusters are left out.",
                                            shownProperty())) {
  least_property_->setMin(1);
}
// NOLINTEND(cppcoreguidelines-owning-memory)

MapLayer::Job FrontierLayer::makeJob(const CuboidMap& map, const ViewRay& ray) {
  const Ogre::Vector3 robot_m = robot_property_->getVector();
  const double resolution_m = map.grid().resolution();
  const CellBox bounds = map.bounds().value_or(CellBox());
  const double middle_m = 0.5 * (bounds.min.z + bounds.max.z) * resolution_m;
  FrontierTask task;
  task.region = findViewedPart(map, ray, middle_m);
  task.min_voxels = static_cast<std::size_t>(least_property_->getInt());
  task.size_m = {robot_m.x, robot_m.y, robot_m.z};
  task.view_range_m = 0.0;
  Job job;
  job.settings = {task.size_m.x(), task.size_m.y(), task.size_m.z(), 1.0 * task.min_voxels,
                  resolution_m};
  job.part = task.region.isEmpty()
                 ? CellBox()
                 : inflate(task.region, task.max_distance_m + task.size_m.maxCoeff(), map.grid());
  job.compute = [=](const CuboidMap& part, const std::atomic<bool>& is_stopped) -> Draw {
    const FrontierPicture picture = findAndDraw(part, task, is_stopped);
    return [=](Ogre::SceneNode& node) { return draw(node, picture, resolution_m); };
  };
  return job;
}

QString FrontierLayer::draw(Ogre::SceneNode& node, const FrontierPicture& picture,
                            double resolution_m) {
  if (voxels_ == nullptr) {
    voxels_ = std::make_unique<ScenePoints>(node, PointCloud::RM_BOXES);
    places_ = std::make_unique<ScenePoints>(node, PointCloud::RM_SPHERES);
  }
  const Ogre::Vector3 robot_m = robot_property_->getVector();
  voxels_->show(picture.voxels, picture.corner, static_cast<float>(kShownEdge * resolution_m));
  places_->show(picture.places, picture.corner, std::min({robot_m.x, robot_m.y, robot_m.z}));
  return QString("clusters: %1, voxels: %2, places to stand: %3%4")
      .arg(picture.num_clusters)
      .arg(picture.voxels.size())
      .arg(picture.places.size())
      .arg(picture.is_complete ? "" : "; 2 s were not enough for all: raise Least voxels");
}

void FrontierLayer::hide() {
  voxels_.reset();
  places_.reset();
}

}  // namespace cuboid_mapping_rviz
