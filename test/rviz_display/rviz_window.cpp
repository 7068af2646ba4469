// SPDX-License-Identifier: BSD-3-Clause
#include "rviz_display/rviz_window.h"

#include <ros/callback_queue.h>
#include <rviz/properties/status_list.h>
#include <rviz/view_controller.h>
#include <rviz/view_manager.h>

#include <OgrePixelFormat.h>
#include <OgreRenderWindow.h>

#include <GL/gl.h>

#include <chrono>

namespace cuboid_mapping_rviz::test {

using Clock = std::chrono::steady_clock;

const rviz::StatusProperty* findStatus(const rviz::Display& display, const std::string& name) {
  for (int i = 0; i < display.numChildren(); ++i) {
    const auto* list = dynamic_cast<const rviz::StatusList*>(display.childAt(i));
    for (int j = 0; list != nullptr && j < list->numChildren(); ++j) {
      const auto* status = dynamic_cast<const rviz::StatusProperty*>(list->childAt(j));
      if (status != nullptr && status->getNameStd() == name) return status;
    }
  }
  return nullptr;
}

QApplication& RvizWindow::application() {
  static int num_arguments = 1;
  static char name[] = "rviz_window";
  static char* arguments[] = {name, nullptr};
  // Never deleted: at the end of the process, objects that it needs are gone.
  static auto* const application = new QApplication(num_arguments, arguments);  // NOLINT
  return *application;
}

RvizWindow::RvizWindow(const QSize& size, const std::string& fixed_frame) {
  panel_.resize(size);
  panel_.show();
  QApplication::processEvents();
  panel_.initialize(manager_.getSceneManager(), &manager_);
  manager_.initialize();
  manager_.setFixedFrame(QString::fromStdString(fixed_frame));
}

rviz::Display* RvizWindow::addDisplay(const std::string& class_name, bool is_enabled) {
  return manager_.createDisplay(QString::fromStdString(class_name), "Display", is_enabled);
}

void RvizWindow::update() {
  QApplication::processEvents();
  if (auto* queue = dynamic_cast<ros::CallbackQueue*>(manager_.getThreadedQueue())) {
    queue->callAvailable();
  }
  manager_.queueRender();
  QMetaObject::invokeMethod(&manager_, "onUpdate");  // rviz calls it by a timer
}

bool RvizWindow::updateUntil(const std::function<bool()>& is_done, double most_s) {
  const auto end = Clock::now() + std::chrono::duration<double>(most_s);
  while (!is_done()) {
    if (Clock::now() > end) return false;
    update();
  }
  return true;
}

void RvizWindow::updateFor(double seconds) {
  (void)updateUntil([] { return false; }, seconds);
}

void RvizWindow::drawFrame() {
  panel_.getRenderWindow()->update(true);
  glFinish();
}

Ogre::RenderTarget::FrameStats RvizWindow::statistics() {
  return panel_.getRenderWindow()->getStatistics();
}

std::vector<unsigned char> RvizWindow::readPixels() {
  Ogre::RenderWindow* window = panel_.getRenderWindow();
  const Ogre::Box area(0, 0, window->getWidth(), window->getHeight());
  std::vector<unsigned char> pixels(std::size_t{3} * area.getWidth() * area.getHeight());
  const Ogre::PixelBox memory(area, Ogre::PF_BYTE_RGB, pixels.data());
#if OGRE_VERSION < ((1 << 16) | (12 << 8))  // Ubuntu 20.04
  window->copyContentsToMemory(memory);
#else
  window->copyContentsToMemory(area, memory);
#endif
  return pixels;
}

void RvizWindow::look(double distance_m, double yaw_rad, double pitch_rad) {
  rviz::ViewManager* views = manager_.getViewManager();
  rviz::ViewController* view = views->getCurrent();
  view->subProp("Distance")->setValue(distance_m);
  view->subProp("Yaw")->setValue(yaw_rad);
  view->subProp("Pitch")->setValue(pitch_rad);
  view->update(0.0F, 0.0F);
}

}  // namespace cuboid_mapping_rviz::test
