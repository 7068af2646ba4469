// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "map_source.h"

#include <OgreSceneNode.h>

namespace rviz {
class BoolProperty;
class Display;
class ViewController;
}  // namespace rviz

namespace cuboid_mapping_rviz {

/// Turns rviz's orbiting view to the map, once, when its first part is there: it may be far from the origin.
/// Thread rule: that of rviz.
class FirstLook {
 public:
  /// Adds a property that switches it on. @param display  Must outlive this object.
  explicit FirstLook(rviz::Display& display);

  /// To be called in each frame once there is a map. @param node  Node in the map frame.
  void update(const MapSource& source, const Ogre::SceneNode& node, rviz::ViewController& view);

 private:
  rviz::BoolProperty* property_;
};

}  // namespace cuboid_mapping_rviz
