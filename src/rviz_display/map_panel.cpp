// SPDX-License-Identifier: BSD-3-Clause
#include "map_panel.h"

#include "cuboid_mapping/LoadMap.h"
#include "cuboid_mapping/SaveMap.h"
#include "cuboid_mapping/SetBox.h"
#include "cuboid_mapping/ros/middleware/names.h"

#include <ros/names.h>
#include <rviz/display.h>
#include <rviz/display_group.h>
#include <rviz/visualization_manager.h>
#include <std_srvs/Empty.h>
#include <std_srvs/SetBool.h>
#include <pluginlib/class_list_macros.hpp>

#include <QCheckBox>
#include <QHBoxLayout>
#include <QLabel>
#include <QLineEdit>
#include <QMessageBox>
#include <QPushButton>
#include <QTimer>
#include <QVBoxLayout>

#include <stdexcept>

namespace cuboid_mapping_rviz {
namespace {

using cuboid_mapping::SetBox;
using diagnostic_msgs::DiagnosticStatus;
namespace names = cuboid_mapping_ros;

constexpr int kLookPeriod_ms = 100;
/// Diagnostics come once a second, unless diagnostic_period says otherwise.
constexpr std::chrono::seconds kMaxSilence{5};

/// The value of a line of a status; empty when there is none.
QString findValue(const DiagnosticStatus& status, const char* key) {
  for (const auto& value : status.values) {
    if (value.key == key) return QString::fromStdString(value.value);
  }
  return {};
}

const char* colorOf(int level) {
  switch (level) {
    case DiagnosticStatus::OK: return "#2e8b57";
    case DiagnosticStatus::WARN: return "#c07000";
    default: return "#c03030";
  }
}

QString paint(const QString& text, const char* color) {
  return QString("<span style='color: %1'>%2</span>").arg(color, text.toHtmlEscaped());
}

}  // namespace

/// An edit of the box.
struct MapPanel::BoxEdit {
  std::uint8_t occupancy;
  bool is_locked;
  const char* when_done;
};

// NOLINTBEGIN(cppcoreguidelines-owning-memory): Qt deletes widgets with their parent
MapPanel::MapPanel(QWidget* parent) : rviz::Panel(parent) {
  server_ = new QLineEdit(names::kNodeName);
  server_->setObjectName("server");
  server_->setToolTip("Name of the node");
  connect(server_, SIGNAL(textChanged(QString)), this, SIGNAL(configChanged()));
  state_ = new QLabel;
  state_->setObjectName("state");
  state_->setWordWrap(true);
  figures_ = new QLabel;
  figures_->setObjectName("figures");
  file_ = new QLineEdit("map.cuboids");
  file_->setObjectName("file");
  file_->setToolTip(
      "File on the machine of the node; relative paths are relative to its working folder");
  connect(file_, SIGNAL(textChanged(QString)), this, SIGNAL(configChanged()));
  box_shown_ = new QCheckBox("Box");
  box_shown_->setObjectName("box");
  box_shown_->setToolTip(
      "Shows a box in the scene; drag its sides, or the box itself (tool Interact)");
  connect(box_shown_, SIGNAL(toggled(bool)), this, SLOT(showBox(bool)));
  locks_ = new QLabel;
  locks_->setObjectName("locks");
  answer_label_ = new QLabel;
  answer_label_->setObjectName("answer");
  answer_label_->setWordWrap(true);

  buttons_ = new QWidget;
  pause_ = addButton("pause", "Pause", SLOT(pauseOrResume()));
  auto* rows = new QVBoxLayout(buttons_);
  rows->setContentsMargins(0, 0, 0, 0);
  rows->addWidget(makeRow({pause_, addButton("reset", "Reset ...", SLOT(reset()))}));
  rows->addWidget(makeRow({new QLabel("File"), file_, addButton("save", "Save", SLOT(saveMap())),
                           addButton("load", "Load ...", SLOT(loadMap()))}));
  rows->addWidget(makeRow({box_shown_, addButton("clear", "Clear", SLOT(clearBox())),
                           addButton("lock", "Lock", SLOT(lockBox())),
                           addButton("unlock", "Unlock", SLOT(unlockBox()))}));

  auto* layout = new QVBoxLayout(this);
  layout->addWidget(makeRow({new QLabel("Server"), server_}));
  layout->addWidget(state_);
  layout->addWidget(figures_);
  layout->addWidget(buttons_);
  layout->addWidget(answer_label_);
  layout->addWidget(locks_);
  layout->addStretch();
  auto* timer = new QTimer(this);
  connect(timer, SIGNAL(timeout()), this, SLOT(look()));
  timer->start(kLookPeriod_ms);
}

QPushButton* MapPanel::addButton(const char* name, const char* text, const char* slot) {
  auto* button = new QPushButton(text);
  button->setObjectName(name);
  connect(button, SIGNAL(clicked()), this, slot);
  return button;
}

QWidget* MapPanel::makeRow(std::initializer_list<QWidget*> widgets) {
  auto* row = new QWidget;
  auto* layout = new QHBoxLayout(row);
  layout->setContentsMargins(0, 0, 0, 0);
  for (QWidget* widget : widgets) layout->addWidget(widget);
  return row;
}
// NOLINTEND(cppcoreguidelines-owning-memory)

void MapPanel::onInitialize() {
  nh_.setCallbackQueue(vis_manager_->getUpdateQueue());  // Callbacks run in this thread.
  diagnostics_ = nh_.subscribe("/diagnostics", 10, &MapPanel::takeDiagnostics, this);
}

void MapPanel::load(const rviz::Config& config) {
  rviz::Panel::load(config);
  QString text;
  if (config.mapGetString("Server", &text)) server_->setText(text);
  if (config.mapGetString("File", &text)) file_->setText(text);
}

void MapPanel::save(rviz::Config config) const {
  rviz::Panel::save(config);
  config.mapSetValue("Server", server_->text());
  config.mapSetValue("File", file_->text());
}

void MapPanel::takeDiagnostics(const diagnostic_msgs::DiagnosticArray::ConstPtr& message) {
  const std::string server = server_->text().toStdString();
  std::string error;
  if (!ros::names::validate(server, error)) return;
  const std::string wanted = ros::names::resolve(server).substr(1) + ": mapping";
  for (const DiagnosticStatus& status : message->status) {
    if (status.name == wanted) showState(status);
  }
}

void MapPanel::showState(const DiagnosticStatus& status) {
  last_heard_ = Clock::now();
  state_->setText(paint(QString::fromStdString(status.message), colorOf(status.level)));
  const double megabytes = 1e-6 * findValue(status, "map bytes").toDouble();
  figures_->setText(QString("revision %1, %2 free and %3 occupied cuboids, %4 MB\n"
                            "clouds: %5 inserted, %6 dropped, the last one applied in %7 ms")
                        .arg(findValue(status, "map revision"), findValue(status, "cuboids free"),
                             findValue(status, "cuboids occupied"))
                        .arg(megabytes, 0, 'f', 1)
                        .arg(findValue(status, "clouds inserted"),
                             findValue(status, "clouds dropped"),
                             findValue(status, "apply time last [ms]")));
  is_paused_ = findValue(status, "paused") == "True";
  pause_->setText(is_paused_ ? "Resume" : "Pause");
}

void MapPanel::look() {
  if (Clock::now() - last_heard_ > kMaxSilence) {
    state_->setText(
        paint("no diagnostics of " + server_->text(), colorOf(DiagnosticStatus::ERROR)));
    figures_->clear();
  }
  takeAnswer();
  if (lock_watch_.update(server_->text().toStdString())) locks_->setText(lock_watch_.text());
}

void MapPanel::start(const char* what, const char* service, const Call& call) {
  if (caller_.isBusy()) return;
  what_ = what;
  answer_label_->setText(what_ + " ...");
  buttons_->setEnabled(false);
  caller_.start([call, server = server_->text().toStdString(), service = std::string(service)] {
    return call(ros::names::resolve(server) + "/" + service);
  });
}

void MapPanel::takeAnswer() {
  if (!caller_.isDone()) return;
  buttons_->setEnabled(true);
  lock_watch_.askSoon();
  try {
    answer_label_->setText(what_ + ": " + QString::fromStdString(caller_.take()));
  } catch (const std::exception& exception) {
    answer_label_->setText(
        paint(what_ + ": " + exception.what(), colorOf(DiagnosticStatus::ERROR)));
  }
}

bool MapPanel::isConfirmed(const QString& question) {
  return QMessageBox::question(this, "Cuboid mapping", question) == QMessageBox::Yes;
}

void MapPanel::pauseOrResume() {
  std_srvs::SetBool::Request request;
  request.data = is_paused_ ? 0 : 1;
  start(is_paused_ ? "Resume" : "Pause", names::kPauseService, [request](const std::string& name) {
    const auto response = call<std_srvs::SetBool>(name, request);
    if (!response.success) throw std::runtime_error(response.message);
    return response.message;
  });
}

void MapPanel::reset() {
  if (!isConfirmed("Forget the whole map of " + server_->text() + "?")) return;
  start("Reset", names::kResetService, [](const std::string& name) {
    call<std_srvs::Empty>(name, {});
    return std::string("the map is empty");
  });
}

void MapPanel::saveMap() {
  cuboid_mapping::SaveMap::Request request;
  request.filename = file_->text().toStdString();
  start("Save", names::kSaveMapService, [request](const std::string& name) {
    const auto response = callAnswered<cuboid_mapping::SaveMap>(name, request);
    return std::to_string(response.cuboids) + " cuboids, " + std::to_string(response.bytes) +
           " bytes";
  });
}

void MapPanel::loadMap() {
  if (!isConfirmed("Replace the map of " + server_->text() + " by " + file_->text() + "?")) return;
  cuboid_mapping::LoadMap::Request request;
  request.filename = file_->text().toStdString();
  start("Load", names::kLoadMapService, [request](const std::string& name) {
    const auto response = callAnswered<cuboid_mapping::LoadMap>(name, request);
    return std::to_string(response.cuboids) + " cuboids";
  });
}

void MapPanel::showBox(bool is_shown) {
  if (!is_shown) {
    if (box_ != nullptr) box_->hide();
    return;
  }
  if (box_ == nullptr) box_ = std::make_unique<BoxMarker>();
  showMarkers();
  box_->show(vis_manager_->getFixedFrame().toStdString());
}

/// Adds rviz's display of interactive markers for the box, unless there is one.
void MapPanel::showMarkers() {
  const QString topic = QString(BoxMarker::kTopic) + "/update";
  rviz::DisplayGroup* displays = vis_manager_->getRootDisplayGroup();
  for (int i = 0; i < displays->numDisplays(); ++i) {
    rviz::Display* display = displays->getDisplayAt(i);
    if (display->getClassId() != "rviz/InteractiveMarkers") continue;
    if (display->subProp("Update Topic")->getValue() == topic) return;
  }
  rviz::Display* display = vis_manager_->createDisplay("rviz/InteractiveMarkers", "Box", true);
  display->subProp("Update Topic")->setValue(topic);
}

void MapPanel::editBox(const char* what, const BoxEdit& edit) {
  if (!box_shown_->isChecked()) {
    answer_label_->setText("show the box first, and pull it to its place");
    return;
  }
  SetBox::Request request;
  request.header.frame_id = box_->frameId();
  request.boxes.emplace_back();
  request.boxes.back().min = toPoint(box_->min());
  request.boxes.back().max = toPoint(box_->max());
  request.occupancy = edit.occupancy;
  request.lock = edit.is_locked ? 1 : 0;
  start(what, names::kSetBoxService,
        [request, when_done = edit.when_done](const std::string& name) {
          const auto response = callAnswered<SetBox>(name, request);
          return response.info.truncated != 0 ? response.info.message : std::string(when_done);
        });
}

void MapPanel::clearBox() { editBox("Clear", {SetBox::Request::FREE, false, "the box is free"}); }

void MapPanel::lockBox() {
  editBox("Lock", {SetBox::Request::KEEP, true, "clouds do not change the box"});
}

void MapPanel::unlockBox() {
  editBox("Unlock", {SetBox::Request::KEEP, false, "clouds change the box again"});
}

}  // namespace cuboid_mapping_rviz

PLUGINLIB_EXPORT_CLASS(cuboid_mapping_rviz::MapPanel, rviz::Panel)
