// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/clouds/source.h"
#include "cuboid_mapping/ros/clouds/source_report.h"
#include "cuboid_mapping/ros/clouds/source_subscriber.h"

#include <diagnostic_updater/diagnostic_updater.h>
#include <ros/node_handle.h>

#include <chrono>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {

/// The sources of a node: their topics, what becomes of their messages, and what has become of them.
///
/// Thread rule: all calls run on the queue of the clouds, one after the other.
class NodeSources {
 public:
  explicit NodeSources(const NodeParameters& parameters);
  NodeSources(const NodeSources&) = delete;
  NodeSources& operator=(const NodeSources&) = delete;

  /// @param nh  See SourceSubscriber. @param take  Is handed each message, side by side.
  void listen(const ros::NodeHandle& nh, const SourceSubscriber::Take& take);
  void stopListening() { subscribers_.clear(); }

  /// Takes other values; the list itself is as it was.
  void setParameters(const NodeParameters& parameters) { sources_ = makeSources(parameters); }

  [[nodiscard]] Source& at(std::size_t source) { return *sources_.at(source); }
  [[nodiscard]] const Source& at(std::size_t source) const { return *sources_.at(source); }

  /// Counts a message. @return false: it is beyond max_rate, and to be ignored.
  [[nodiscard]] bool receive(const SensorMessage& message);
  void noteInserted(std::size_t source) { ++figures_.at(source).now.num_inserted; }
  /// So many of a source have gone without being received, or after that.
  void noteLost(std::size_t source, std::size_t count);
  void noteDropped(std::size_t source, const std::string& why);

  /// Names after remapping, as "/front/points, /scan".
  [[nodiscard]] const std::string& topics() const { return topics_; }
  /// Of all topics.
  [[nodiscard]] std::size_t numPublishers() const;

  /// Adds a status for each source; none where there is no list.
  void addDiagnostics(diagnostic_updater::Updater& diagnostics);

 private:
  using Clock = std::chrono::steady_clock;

  struct Figures {
    SourceStatistics now;
    SourceStatistics reported;
    Clock::time_point last_received = Clock::now();
  };

  void report(std::size_t source, diagnostic_updater::DiagnosticStatusWrapper& status);

  bool has_list_;
  std::vector<std::unique_ptr<Source>> sources_;
  std::vector<Figures> figures_;
  std::vector<std::unique_ptr<SourceSubscriber>> subscribers_;
  std::string topics_;
};

}  // namespace cuboid_mapping_ros
