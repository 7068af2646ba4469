// SPDX-License-Identifier: BSD-3-Clause
#include "lock_watch.h"

#include "cuboid_mapping/ros/middleware/names.h"

#include <ros/names.h>

#include <algorithm>
#include <exception>

namespace cuboid_mapping_rviz {
namespace {

constexpr std::chrono::seconds kPeriod{2};
constexpr std::size_t kMaxLines = 5;

QString toText(const geometry_msgs::Point& point) {
  return QString("(%1, %2, %3)").arg(point.x).arg(point.y).arg(point.z);
}

}  // namespace

bool LockWatch::update(const std::string& server) {
  bool is_changed = false;
  if (caller_.isDone()) {
    Locks locks;
    try {
      locks = caller_.take();
    } catch (const std::exception&) {  // No node offers the service.
    }
    is_changed =
        locks.boxes != locks_.boxes || locks.info.header.frame_id != locks_.info.header.frame_id;
    locks_ = std::move(locks);
  }
  if (!caller_.isBusy() && Clock::now() - last_asked_ > kPeriod) {
    last_asked_ = Clock::now();
    caller_.start([server] {
      return callAnswered<cuboid_mapping::GetLocks>(
          ros::names::resolve(server) + "/" + cuboid_mapping_ros::kGetLocksService, {});
    });
  }
  return is_changed;
}

QString LockWatch::text() const {
  if (locks_.boxes.empty()) return {};
  QString text = QString("locked boxes: %1").arg(locks_.boxes.size());
  const std::size_t num_lines = std::min(kMaxLines, locks_.boxes.size());
  for (std::size_t i = 0; i < num_lines; ++i) {
    text += "\n" + toText(locks_.boxes[i].min) + " to " + toText(locks_.boxes[i].max) + " m";
  }
  return num_lines < locks_.boxes.size() ? text + "\n..." : text;
}

}  // namespace cuboid_mapping_rviz
