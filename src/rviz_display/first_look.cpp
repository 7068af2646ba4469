// SPDX-License-Identifier: BSD-3-Clause
#include "first_look.h"

#include <rviz/display.h>
#include <rviz/properties/bool_property.h>
#include <rviz/view_controller.h>

#include <OgreVector3.h>

#include <optional>

namespace cuboid_mapping_rviz {

using namespace cuboid_mapping;

// NOLINTBEGIN(cppcoreguidelines-owning-memory): rviz deletes properties with their display
FirstLook::FirstLook(rviz::Display& display)
    : property_(new rviz::BoolProperty(
          "Look at map", false, "Turn an orbiting view to the map as soon as there is one, once.",
          &display)) {}
// NOLINTEND(cppcoreguidelines-owning-memory)

void FirstLook::update(const MapSource& source, const Ogre::SceneNode& node,
                       rviz::ViewController& view) {
  if (!property_->getBool()) return;
  std::optional<MetricBox> known_map;
  source.read([&](const CuboidMap& map) {
    if (const auto bounds = map.bounds()) known_map = map.grid().toMetricBox(*bounds);
  });
  if (!known_map) return;
  property_->setValue(false);
  if (view.getClassId() != "rviz/Orbit") return;
  const Eigen::Vector3f middle = (0.5 * (known_map->min_m + known_map->max_m)).cast<float>();
  const Ogre::Vector3 focus =
      node.getPosition() +
      node.getOrientation() * Ogre::Vector3(middle.x(), middle.y(), middle.z());
  for (int axis = 0; axis < 3; ++axis) {
    view.subProp("Focal Point")->subProp(QString("XYZ"[axis]))->setValue(focus[axis]);
  }
  view.subProp("Distance")->setValue((known_map->max_m - known_map->min_m).norm());
}

}  // namespace cuboid_mapping_rviz
