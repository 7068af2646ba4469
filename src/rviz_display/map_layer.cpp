// SPDX-License-Identifier: BSD-3-Clause
#include "map_layer.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <utility>

namespace cuboid_mapping_rviz {
namespace {

using namespace cuboid_mapping;
using rviz::StatusProperty;

constexpr std::chrono::milliseconds kLeastPeriod{500};
constexpr std::int32_t kViewStep = 64;

Eigen::Vector3d toEigen(const Ogre::Vector3& vector) { return {vector.x, vector.y, vector.z}; }

CuboidMap copyPart(const MapSource& source, const CellBox& part) {
  MapConfig config;
  std::vector<VoxelBrick> bricks;
  source.read([&](const CuboidMap& map) {
    config.resolution_m = map.grid().resolution();
    bricks = map.voxels().copyIn(part);
  });
  CuboidMap copy(config);
  copy.replace(part, std::move(bricks));
  return copy;
}

}  // namespace

ViewRay findViewRay(const Ogre::Camera& camera, const Ogre::SceneNode& node) {
  const Ogre::Quaternion to_map = node._getDerivedOrientation().Inverse();
  return {toEigen(to_map * (camera.getDerivedPosition() - node._getDerivedPosition())),
          toEigen(to_map * camera.getDerivedDirection())};
}

std::int32_t layerAt(const Grid& grid, double height_m) {
  const double below_m = 1e-4 * grid.resolution();
  const auto cell = grid.toCell({0.0, 0.0, height_m - below_m});
  return cell.value_or(Cell{0, 0, Grid::kMaxCell - 1}).z;
}

CellBox findViewedPart(const CuboidMap& map, const ViewRay& ray, double height_m) {
  const double away = (height_m - ray.eye_map.z()) / ray.direction_map.z();
  const bool is_on_plane = away > 0.0 && std::isfinite(away);
  const auto center =
      map.grid().toCell(ray.eye_map + (is_on_plane ? away : 0.0) * ray.direction_map);
  const auto bounds = map.bounds();
  if (!center || !bounds) return {};
  CellBox part = *bounds;
  for (const int axis : {0, 1}) {
    const std::int32_t step_center = (*center)[axis] & ~(kViewStep - 1);
    const std::int32_t min = step_center + kViewStep / 2 - kViewedEdge / 2;
    part.min[axis] = std::max(part.min[axis], min);
    part.max[axis] = std::min(part.max[axis], min + kViewedEdge);
  }
  return part;
}

MapLayer::MapLayer(rviz::Display& display, const char* name, const char* help)
    : display_(display),
      // rviz deletes properties with their display.
      shown_property_(new rviz::BoolProperty(name, false, help, &display)) {  // NOLINT
  shown_property_->setDisableChildrenIfFalse(true);
}

bool MapLayer::update(const MapSource& source, Ogre::SceneNode& node, const ViewRay& ray) {
  if (!shown_property_->getBool()) {
    const bool was_drawn = !is_clear_;
    clear();
    return was_drawn;
  }
  if (!isBusy()) {
    if (Clock::now() >= next_start_) start(source, ray);
    return false;
  }
  if (draw_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return false;
  draw(node);
  return true;
}

void MapLayer::start(const MapSource& source, const ViewRay& ray) {
  Job job;
  source.read([&](const CuboidMap& map) { job = makeJob(map, ray); });
  start_ = Clock::now();
  next_start_ = start_ + kLeastPeriod;
  if (!is_due_ && job.part == job_.part && job.settings == job_.settings) return;
  job_ = job;
  is_due_ = is_clear_ = false;
  draw_ = std::async(std::launch::async, [this, &source, job = std::move(job)] {
    return job.compute(copyPart(source, job.part), is_stopped_);
  });
}

void MapLayer::draw(Ogre::SceneNode& node) {
  const Clock::duration worked = Clock::now() - start_;
  next_start_ = std::max(next_start_, Clock::now() + worked);
  const QString name = shown_property_->getName();
  try {
    const QString text = draw_.get()(node);
    display_.setStatus(
        StatusProperty::Ok, name,
        QString("%1, computed in %2 ms")
            .arg(text)
            .arg(std::chrono::duration<double, std::milli>(worked).count(), 0, 'f', 0));
  } catch (const std::exception& exception) {
    hide();
    display_.setStatus(StatusProperty::Error, name, exception.what());
  }
}

void MapLayer::stop() {
  is_stopped_ = true;
  draw_ = {};  // Waits for the thread.
  is_stopped_ = false;
}

void MapLayer::clear() {
  if (is_clear_) return;
  stop();
  hide();
  display_.deleteStatus(shown_property_->getName());
  is_due_ = is_clear_ = true;
}

}  // namespace cuboid_mapping_rviz
