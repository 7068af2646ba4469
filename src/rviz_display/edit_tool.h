// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#ifndef Q_MOC_RUN
#include "lock_watch.h"
#include "service_caller.h"
#include "wire_boxes.h"

#include <rviz/tool.h>
#endif

#include <OgrePlane.h>
#include <OgreVector3.h>

#include <functional>
#include <memory>
#include <optional>
#include <string>

namespace rviz {
class EnumProperty;
class FloatProperty;
class StringProperty;
}  // namespace rviz

namespace cuboid_mapping_rviz {

/// rviz's tool "Edit Box": the left button drags the ground plan of a box over the map; its release calls
/// ~set_box. The key u calls ~undo_edit. Locked boxes are shown while the tool is active. Other buttons move
/// the view.
class EditTool : public rviz::Tool {
  Q_OBJECT
 public:
  EditTool();

  void onInitialize() override;
  void activate() override;
  void deactivate() override;
  void update(float wall_dt, float ros_dt) override;
  int processMouseEvent(rviz::ViewportMouseEvent& event) override;
  int processKeyEvent(QKeyEvent* event, rviz::RenderPanel* panel) override;

 private:
  /// Opposite corners of the ground plan, fixed frame.
  struct Drag {
    Ogre::Vector3 from;
    Ogre::Vector3 to;
  };

  [[nodiscard]] std::optional<Ogre::Vector3> findPoint(rviz::ViewportMouseEvent& event) const;
  void drag(rviz::ViewportMouseEvent& event);
  /// The box of a drag, with the height of the property.
  [[nodiscard]] cuboid_mapping::Box box() const;
  void showDrag();
  void placeLocks();
  void setBox();
  void undo();
  /// Calls a service of the server. @param work  Gets its name, returns the text for the status line.
  void start(const char* service, const std::function<std::string(const std::string&)>& work);

  rviz::StringProperty* server_property_;
  rviz::EnumProperty* action_property_;
  rviz::FloatProperty* height_property_;
  rviz::FloatProperty* bottom_property_;
  std::optional<Drag> drag_;
  std::unique_ptr<WireBoxes> dragged_;
  std::unique_ptr<WireBoxes> locked_;
  LockWatch locks_;
  ServiceCaller<std::string> caller_;
};

}  // namespace cuboid_mapping_rviz
