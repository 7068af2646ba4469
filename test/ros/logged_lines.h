// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/console.h>

#include <mutex>
#include <string>
#include <utility>
#include <vector>

namespace cuboid_mapping_ros {

/// Lines of this process's log. They are collected to its end: rosconsole of Noetic deletes a deregistered appender twice.
class LoggedLines : public ros::console::LogAppender {
 public:
  /// The lines since the last call; none at the first one.
  [[nodiscard]] static std::vector<std::string> take() {
    static auto* const kLines = new LoggedLines;
    const std::lock_guard<std::mutex> lock(kLines->mutex_);
    return std::exchange(kLines->lines_, {});
  }

  void log(ros::console::Level /*level*/, const char* text, const char* /*file*/,
           const char* /*function*/, int /*line*/) override {
    const std::lock_guard<std::mutex> lock(mutex_);
    lines_.emplace_back(text);
  }

 private:
  LoggedLines() { ros::console::register_appender(this); }

  std::mutex mutex_;
  std::vector<std::string> lines_;
};

}  // namespace cuboid_mapping_ros
