// SPDX-License-Identifier: BSD-3-Clause
#include "edit_tool.h"

#include "box_marker.h"

#include "cuboid_mapping/SetBox.h"
#include "cuboid_mapping/ros/middleware/names.h"

#include <ros/names.h>
#include <rviz/display_context.h>
#include <rviz/frame_manager.h>
#include <rviz/geometry.h>
#include <rviz/properties/enum_property.h>
#include <rviz/properties/float_property.h>
#include <rviz/properties/string_property.h>
#include <rviz/selection/selection_manager.h>
#include <rviz/view_controller.h>
#include <rviz/view_manager.h>
#include <rviz/viewport_mouse_event.h>
#include <std_srvs/Trigger.h>
#include <pluginlib/class_list_macros.hpp>

#include <OgreCamera.h>
#include <OgreViewport.h>

#include <QKeyEvent>

#include <algorithm>
#include <exception>
#include <stdexcept>

namespace cuboid_mapping_rviz {
namespace {

using cuboid_mapping::SetBox;
namespace names = cuboid_mapping_ros;

constexpr float kLeastHeight_m = 0.01F;

enum class Action { kFree, kOccupied, kUnknown, kLock, kUnlock };

std::optional<Ogre::Vector3> findOnPlane(rviz::ViewportMouseEvent& event, Ogre::Plane plane) {
  Ogre::Vector3 point;
  const bool is_hit =
      rviz::getPointOnPlaneFromWindowXY(event.viewport, plane, event.x, event.y, point);
  return is_hit ? std::make_optional(point) : std::nullopt;
}

/// Whether an event moves the view, by a button or the wheel: the view then replaces the status line by its
/// help.
bool movesView(rviz::ViewportMouseEvent& event) {
  const bool is_hovering = event.type == QEvent::MouseMove && event.buttons_down == Qt::NoButton;
  return !is_hovering && !event.left() && !event.leftUp();
}

SetBox::Request makeRequest(Action action) {
  SetBox::Request request;
  request.occupancy = action == Action::kFree       ? SetBox::Request::FREE
                      : action == Action::kOccupied ? SetBox::Request::OCCUPIED
                      : action == Action::kUnknown  ? SetBox::Request::UNKNOWN
                                                    : SetBox::Request::KEEP;
  request.lock = action == Action::kLock ? 1 : 0;
  return request;
}

}  // namespace

// NOLINTBEGIN(cppcoreguidelines-owning-memory): rviz deletes properties with their container
EditTool::EditTool() {
  shortcut_key_ = 'b';
  server_property_ = new rviz::StringProperty("Server", names::kNodeName, "Name of the node.",
                                              getPropertyContainer());
  action_property_ =
      new rviz::EnumProperty("Action", "Free", "Change of the box.", getPropertyContainer());
  action_property_->addOption("Free", static_cast<int>(Action::kFree));
  action_property_->addOption("Occupied", static_cast<int>(Action::kOccupied));
  action_property_->addOption("Unknown", static_cast<int>(Action::kUnknown));
  action_property_->addOption("Lock", static_cast<int>(Action::kLock));
  action_property_->addOption("Unlock", static_cast<int>(Action::kUnlock));
  height_property_ = new rviz::FloatProperty(
      "Height", 2.0F, "Height of the box, in m. Shift while dragging sets it.",
      getPropertyContainer());
  height_property_->setMin(kLeastHeight_m);
  bottom_property_ = new rviz::FloatProperty(
      "Bottom", 0.05F,
      "Bottom of the box above the point where the drag begins, in m; negative: below.",
      getPropertyContainer());
}
// NOLINTEND(cppcoreguidelines-owning-memory)

void EditTool::onInitialize() {
  setName("Edit Box");
  Ogre::SceneManager& scene = *context_->getSceneManager();
  dragged_ = std::make_unique<WireBoxes>(scene, Ogre::ColourValue(1.0F, 0.9F, 0.2F));
  locked_ = std::make_unique<WireBoxes>(scene, Ogre::ColourValue(1.0F, 0.3F, 0.9F));
  locked_->node().setVisible(false);
}

void EditTool::activate() {
  setStatus("Drag a box over the map; Shift: height; u: undo.");
  locked_->node().setVisible(true);
  locks_.askSoon();
}

void EditTool::deactivate() {
  drag_.reset();
  showDrag();
  locked_->node().setVisible(false);
}

void EditTool::update(float /*wall_dt*/, float /*ros_dt*/) {
  if (caller_.isDone()) {
    try {
      setStatus(QString::fromStdString(caller_.take()));
    } catch (const std::exception& exception) {
      setStatus(QString("<b>Not done:</b> ") + QString(exception.what()).toHtmlEscaped());
    }
    locks_.askSoon();
  }
  if (locks_.update(server_property_->getStdString())) locked_->show(locks_.locks().boxes);
  placeLocks();
}

void EditTool::placeLocks() {
  Ogre::Vector3 position;
  Ogre::Quaternion orientation;
  const bool is_placed = context_->getFrameManager()->getTransform(
      locks_.locks().info.header.frame_id, ros::Time(), position, orientation);
  locked_->node().setVisible(is_placed);
  if (!is_placed) return;
  locked_->node().setPosition(position);
  locked_->node().setOrientation(orientation);
}

int EditTool::processMouseEvent(rviz::ViewportMouseEvent& event) {
  if (event.leftDown()) {
    if (const auto point = findPoint(event)) drag_ = Drag{*point, *point};
  } else if (event.leftUp() && drag_) {
    setBox();
    drag_.reset();
  } else if (event.left() && drag_) {
    drag(event);
  } else if (movesView(event) && context_->getViewManager()->getCurrent() != nullptr) {
    context_->getViewManager()->getCurrent()->handleMouseEvent(event);
  }
  showDrag();
  return Render;
}

int EditTool::processKeyEvent(QKeyEvent* event, rviz::RenderPanel* /*panel*/) {
  if (event->key() == Qt::Key_U) undo();
  return 0;
}

/// The visible point under the mouse, or a point of the ground.
std::optional<Ogre::Vector3> EditTool::findPoint(rviz::ViewportMouseEvent& event) const {
  Ogre::Vector3 point;
  if (context_->getSelectionManager()->get3DPoint(event.viewport, event.x, event.y, point)) {
    return point;
  }
  return findOnPlane(event, Ogre::Plane(Ogre::Vector3::UNIT_Z, 0.0F));
}

void EditTool::drag(rviz::ViewportMouseEvent& event) {
  if (!event.shift()) {
    const auto point = findOnPlane(event, Ogre::Plane(Ogre::Vector3::UNIT_Z, drag_->from.z));
    if (point) drag_->to = *point;
    return;
  }
  Ogre::Vector3 across = event.viewport->getCamera()->getDerivedDirection();
  across.z = 0.0F;
  if (across.normalise() == 0.0F) return;  // The view is from above.
  if (const auto point = findOnPlane(event, Ogre::Plane(across, drag_->to))) {
    height_property_->setFloat(
        std::max(kLeastHeight_m, point->z - drag_->from.z - bottom_property_->getFloat()));
  }
}

cuboid_mapping::Box EditTool::box() const {
  Ogre::Vector3 min = drag_->from;
  Ogre::Vector3 max = drag_->from;
  min.makeFloor(drag_->to);
  max.makeCeil(drag_->to);
  min.z = drag_->from.z + bottom_property_->getFloat();
  max.z = min.z + height_property_->getFloat();
  cuboid_mapping::Box box;
  box.min = toPoint(min);
  box.max = toPoint(max);
  return box;
}

void EditTool::showDrag() {
  dragged_->show(drag_ ? std::vector<cuboid_mapping::Box>{box()}
                       : std::vector<cuboid_mapping::Box>());
}

void EditTool::setBox() {
  if (drag_->from.x == drag_->to.x || drag_->from.y == drag_->to.y) return;  // A click.
  SetBox::Request request = makeRequest(static_cast<Action>(action_property_->getOptionInt()));
  request.header.frame_id = context_->getFixedFrame().toStdString();
  request.boxes = {box()};
  const std::string done = action_property_->getStdString();
  start(names::kSetBoxService, [request, done](const std::string& name) {
    const auto response = callAnswered<SetBox>(name, request);
    return done + ": " + (response.info.message.empty() ? "done" : response.info.message);
  });
}

void EditTool::undo() {
  start(names::kUndoEditService, [](const std::string& name) {
    const auto response = call<std_srvs::Trigger>(name, {});
    if (response.success == 0) throw std::runtime_error(response.message);
    return response.message;
  });
}

void EditTool::start(const char* service,
                     const std::function<std::string(const std::string&)>& work) {
  if (caller_.isBusy()) return setStatus("The last edit is under way.");
  const std::string server = server_property_->getStdString();
  caller_.start([=] { return work(ros::names::resolve(server) + "/" + service); });
}

}  // namespace cuboid_mapping_rviz

PLUGINLIB_EXPORT_CLASS(cuboid_mapping_rviz::EditTool, rviz::Tool)
