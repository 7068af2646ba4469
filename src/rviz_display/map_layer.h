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
#include <optional>
#include <vector>

namespace cuboid_mapping_rviz {

/// A straight line into the scene.
struct ViewRay {
  Eigen::Vector3d eye_map;
  Eigen::Vector3d direction_map;
};

/// The ray through the middle of a picture. @param node  In the map frame.
[[nodiscard]] ViewRay findViewRay(const Ogre::Camera& camera, const Ogre::SceneNode& node);

/// The layer of voxels that a horizontal plane cuts; between two layers the lower one, at its upper side.
[[nodiscard]] std::int32_t layerAt(const cuboid_mapping::Grid& grid, double height_m);

/// Edge of the part of the map that layers are computed of, in voxels.
constexpr std::int32_t kViewedEdge = 512;

/// The known part of a map, at all heights, in kViewedEdge x kViewedEdge voxels around the place where a view looks at
/// a horizontal plane, or around the eye where it does not; it moves in steps of 64 voxels. Empty when nothing is
/// known there.
[[nodiscard]] cuboid_mapping::CellBox findViewedPart(const cuboid_mapping::CuboidMap& map,
                                                     const ViewRay& ray, double height_m);

/// What a display draws besides the map, computed of the part that the view looks at.
///
/// The work is done in a thread of its own on a copy of the part: neither rviz nor updates of the map wait for it. It
/// is done when the map, the view or a property has changed, twice a second at most, and it rests as long as it worked.
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
  /// To be called in each frame, once there is a map. @param source, node  They must outlive the picture, see clear().
  /// @param node  In the map frame.
  /// @return Whether something else is drawn.
  bool update(const MapSource& source, Ogre::SceneNode& node, const ViewRay& ray);
  /// Draws nothing, and ends the work; waits for it.
  void clear();

 protected:
  /// Draws what was computed, in rviz's thread. @return A line for the status.
  using Draw = std::function<QString(Ogre::SceneNode& node)>;
  struct Job {
    cuboid_mapping::CellBox part;  ///< Of the map, to be copied; empty: nothing is drawn.
    std::vector<double> settings;  ///< Other ones, or another part, have to be computed anew.
    /// Computes, in another thread; ends early when it is_stopped.
    std::function<Draw(cuboid_mapping::CuboidMap part, const std::atomic<bool>& is_stopped)>
        compute;
  };

  [[nodiscard]] rviz::BoolProperty* shownProperty() const { return shown_property_; }
  /// What should be drawn now.
  [[nodiscard]] virtual Job makeJob(const cuboid_mapping::CuboidMap& map, const ViewRay& ray) = 0;
  /// Draws nothing.
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
  Job job_;  ///< The last one.
  Clock::time_point start_;
  Clock::time_point next_start_;
  std::atomic<bool> is_stopped_{false};
  std::future<Draw> draw_;  ///< Last: waits for its thread when it goes.
};

}  // namespace cuboid_mapping_rviz
