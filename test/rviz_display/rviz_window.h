// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <QApplication>

#include <rviz/display.h>
#include <rviz/properties/status_property.h>
#include <rviz/render_panel.h>
#include <rviz/visualization_manager.h>

#include <OgreRenderTarget.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace cuboid_mapping_rviz::test {

/// A line of the status of a display; null when there is none of that name.
[[nodiscard]] const rviz::StatusProperty* findStatus(const rviz::Display& display,
                                                     const std::string& name);

/// rviz's scene in a window of its own, drawn frame by frame. One at a time; needs a screen and a roscore.
class RvizWindow {
 public:
  /// @param fixed_frame  Fixed frame of the scene.
  explicit RvizWindow(const QSize& size, const std::string& fixed_frame = "map");

  /// Adds a display by the name of its class. It is deleted with the window, or before.
  rviz::Display* addDisplay(const std::string& class_name, bool is_enabled = true);

  /// One update of rviz: callbacks, displays, and a frame.
  void update();
  /// Calls update() until is_done, for some seconds at most. @return is_done().
  bool updateUntil(const std::function<bool()>& is_done, double most_s = 60.0);
  /// Calls update() for some seconds.
  void updateFor(double seconds);
  /// Draws a frame without any other update of rviz, and waits until it is drawn.
  void drawFrame();

  [[nodiscard]] rviz::VisualizationManager& manager() { return manager_; }
  /// Panel that takes mouse and key events.
  [[nodiscard]] rviz::RenderPanel& panel() { return panel_; }
  /// Statistics of the last frame.
  [[nodiscard]] Ogre::RenderTarget::FrameStats statistics();
  /// Red, green and blue of all pixels, one after the other.
  std::vector<unsigned char> readPixels();
  /// Looks at the origin of the fixed frame. @param yaw_rad  Angle about its z axis.
  void look(double distance_m, double yaw_rad, double pitch_rad);

 private:
  static QApplication& application();

  QApplication& application_ = application();
  rviz::RenderPanel panel_;
  rviz::VisualizationManager manager_{&panel_};
};

}  // namespace cuboid_mapping_rviz::test
