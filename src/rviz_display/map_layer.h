// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "map_source.h"

#include <rviz/display.h>
#include <rviz/properties/bool_property.h>

#include <OgreCamera.h>
#include <OgreSceneNode.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <future>
#include <vector>

namespace cuboid_mapping_rviz {

/// A straight line into the scene.
struct ViewRay {
  Eigen::Vector3d eye_map;
  Eigen::Vector3d direction_map;
};

/// The ray through the middle of the view. @param node  Node in the map frame.
[[nodiscard]] ViewRay findViewRay(const Ogre::Camera& camera, const Ogre::SceneNode& node);

/// The layer of voxels that a horizontal plane cuts; on the border of two layers, the lower one.
[[nodiscard]] std::int32_t layerAt(const cuboid_mapping::Grid& grid, double height_m);

/// Edge of the part of the map for which layers are computed, in voxels.
constexpr std::int32_t kViewedEdge = 512;

/// The known part of a map, at all heights, in kViewedEdge x kViewedEdge voxels around the point where the ray
/// meets a horizontal plane, or around the eye if it does not; it moves in steps of 64 voxels. Empty if nothing
/// is known there.
[[nodiscard]] cuboid_mapping::CellBox findViewedPart(const cuboid_mapping::CuboidMap& map,
                                                     const ViewRay& ray, double height_m);

/// An additional picture of a display, computed from the viewed part of the map.
///
/// A thread of its own computes it from a copy of the part: neither rviz nor updates of the map wait for it. It
/// runs when the map, the view or a property has changed, at most twice a second, and then pauses for as long
/// as it has worked.
/// Thread rule: that of rviz.
class MapLayer {
 public:
  /// Adds a property that shows the layer, off. @param display  Must outlive this object.
  MapLayer(rviz::Display& display, const char* name, const char* help);
  virtual ~MapLayer() { stop(); }
  MapLayer(const MapLayer&) = delete;
  MapLayer& operator=(const MapLayer&) = delete;

  void noteChanges(const cuboid_mapping::ChangeSet& changes) {
    is_due_ |= changes.is_everything || !changes.bricks.empty();
  }
  /// To be called in each frame once there is a map. @param source, node  Must outlive the picture, see
  /// clear(). The node is in the map frame. @return Whether the drawing has changed.
  bool update(const MapSource& source, Ogre::SceneNode& node, const ViewRay& ray);
  /// Removes the picture, and waits for the end of the work.
  void clear();

 protected:
  /// Draws a computed picture, in rviz's thread. @return A line for the status.
  using Draw = std::function<QString(Ogre::SceneNode& node)>;
  struct Job {
    cuboid_mapping::CellBox part;  ///< Part of the map to be copied; empty: nothing is drawn.
    /// Settings whose change, like that of the part, needs a new picture.
    std::vector<double> settings;
    /// Computes the picture, in another thread; ends early if is_stopped.
    std::function<Draw(cuboid_mapping::CuboidMap part, const std::atomic<bool>& is_stopped)>
        compute;
  };

  [[nodiscard]] rviz::BoolProperty* shownProperty() const { return shown_property_; }
  /// The job for the current map, view and properties.
  [[nodiscard]] virtual Job makeJob(const cuboid_mapping::CuboidMap& map, const ViewRay& ray) = 0;
  /// Removes the picture.
  virtual void hide() = 0;

 private:
  using Clock = std::chrono::steady_clock;

  void start(const MapSource& source, const ViewRay& ray);
  void draw(Ogre::SceneNode& node);
  void stop();
  [[nodiscard]] bool isBusy() const { return draw_.valid(); }

  rviz::Display& display_;
  rviz::BoolProperty* shown_property_;
  bool is_due_ = true;
  bool is_clear_ = true;
  Job job_;  ///< The last job.
  Clock::time_point start_;
  Clock::time_point next_start_;
  std::atomic<bool> is_stopped_{false};
  std::future<Draw> draw_;  ///< Last member: its destructor waits for the thread.
};

}  // namespace cuboid_mapping_rviz
