// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/Box.h"

#include <OgreColourValue.h>
#include <OgreManualObject.h>
#include <OgreSceneManager.h>
#include <OgreSceneNode.h>

#include <vector>

namespace cuboid_mapping_rviz {

/// The edges of boxes in a scene. Thread rule: that of rviz.
class WireBoxes {
 public:
  WireBoxes(Ogre::SceneManager& scene, const Ogre::ColourValue& color)
      : scene_(scene),
        color_(color),
        node_(*scene.getRootSceneNode()->createChildSceneNode()),
        edges_(*scene.createManualObject()) {
    node_.attachObject(&edges_);
  }
  ~WireBoxes() {
    scene_.destroyManualObject(&edges_);
    scene_.destroySceneNode(&node_);
  }
  WireBoxes(const WireBoxes&) = delete;
  WireBoxes& operator=(const WireBoxes&) = delete;

  /// Replaces the boxes. @param boxes  In the frame of node().
  void show(const std::vector<cuboid_mapping::Box>& boxes);
  [[nodiscard]] Ogre::SceneNode& node() { return node_; }

 private:
  Ogre::SceneManager& scene_;
  Ogre::ColourValue color_;
  Ogre::SceneNode& node_;
  Ogre::ManualObject& edges_;
};

}  // namespace cuboid_mapping_rviz
