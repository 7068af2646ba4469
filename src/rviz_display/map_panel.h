// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#ifndef Q_MOC_RUN
#include "box_marker.h"
#include "lock_watch.h"
#include "service_caller.h"

#include <diagnostic_msgs/DiagnosticArray.h>
#include <ros/node_handle.h>
#include <ros/subscriber.h>
#include <rviz/panel.h>
#endif

#include <chrono>
#include <functional>
#include <memory>
#include <string>

class QCheckBox;
class QLabel;
class QLineEdit;
class QPushButton;
class QWidget;

namespace cuboid_mapping_rviz {

/// rviz's panel "Cuboid mapping": the state of a node from /diagnostics, and its services as buttons.
///
/// Services are called by a ServiceCaller, one at a time. Widgets have names for tests.
class MapPanel : public rviz::Panel {
  Q_OBJECT
 public:
  explicit MapPanel(QWidget* parent = nullptr);

  void onInitialize() override;
  void load(const rviz::Config& config) override;
  void save(rviz::Config config) const override;

 private Q_SLOTS:
  void look();
  void pauseOrResume();
  void reset();
  void saveMap();
  void loadMap();
  void showBox(bool is_shown);
  void clearBox();
  void lockBox();
  void unlockBox();

 private:
  using Clock = std::chrono::steady_clock;
  /// Calls a service by its name. Returns the text of the answer.
  using Call = std::function<std::string(const std::string& name)>;
  struct BoxEdit;

  QPushButton* addButton(const char* name, const char* text, const char* slot);
  QWidget* makeRow(std::initializer_list<QWidget*> widgets);
  [[nodiscard]] bool isConfirmed(const QString& question);
  void takeDiagnostics(const diagnostic_msgs::DiagnosticArray::ConstPtr& message);
  void showState(const diagnostic_msgs::DiagnosticStatus& status);
  void start(const char* what, const char* service, const Call& call);
  void takeAnswer();
  void editBox(const char* what, const BoxEdit& edit);
  void showMarkers();

  QLineEdit* server_ = nullptr;
  QLabel* state_ = nullptr;
  QLabel* figures_ = nullptr;
  QPushButton* pause_ = nullptr;
  QLineEdit* file_ = nullptr;
  QCheckBox* box_shown_ = nullptr;
  QLabel* locks_ = nullptr;
  QLabel* answer_label_ = nullptr;
  QWidget* buttons_ = nullptr;

  bool is_paused_ = false;  ///< Last state from the server.
  Clock::time_point last_heard_;
  QString what_;  ///< Name of the running call.
  ServiceCaller<std::string> caller_;
  LockWatch lock_watch_;
  std::unique_ptr<BoxMarker> box_;
  ros::NodeHandle nh_;
  ros::Subscriber diagnostics_;
};

}  // namespace cuboid_mapping_rviz
