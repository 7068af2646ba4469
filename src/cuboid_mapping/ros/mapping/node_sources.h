// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/diagnostics/cloud_ledger.h"
#include "cuboid_mapping/ros/diagnostics/diagnostics.h"
#include "cuboid_mapping/ros/mapping/source_subscriber.h"

#include <diagnostic_updater/diagnostic_updater.h>
#include <ros/node_handle.h>

#include <algorithm>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {

/// The topics of a node's sources: subscribers, statistics, diagnostics. Not thread-safe.
class NodeSources {
 public:
  NodeSources(const NodeParameters& parameters, const CloudLedger& ledger);
  NodeSources(const NodeSources&) = delete;
  NodeSources& operator=(const NodeSources&) = delete;

  /// @param nh, callbacks  See SourceSubscriber.
  void listen(const ros::NodeHandle& nh, const SourceSubscriber::Callbacks& callbacks);
  void stopListening() { subscribers_.clear(); }

  /// The parameters at the start: names, topics and types do not change.
  [[nodiscard]] const SourceParameters& at(std::size_t source) const { return sources_.at(source); }

  /// Topics after remapping, such as "/front/points, /scan".
  [[nodiscard]] const std::string& topics() const { return topics_; }
  /// Number of publishers of all topics.
  [[nodiscard]] std::size_t numPublishers() const;

  /// Errors of topics that are published with another type than their source's, joined; see
  /// describeWrongType(). Logs each new text. Asks the master, for sources that have received nothing and have
  /// no publisher.
  [[nodiscard]] std::string findWrongTypes();
  /// Whether a topic has a publisher, but no connection, as the last findWrongTypes() found.
  [[nodiscard]] bool isPublished() const {
    return std::any_of(is_published_.begin(), is_published_.end(), [](bool is) { return is; });
  }
  /// Topics with messages for the sources that nobody publishes, as the last findWrongTypes() found them.
  [[nodiscard]] const std::string& otherTopics() const { return other_topics_; }

  /// Adds a status for each source; none where there is no list.
  void addDiagnostics(diagnostic_updater::Updater& diagnostics);

 private:
  void report(std::size_t source, diagnostic_updater::DiagnosticStatusWrapper& status);

  bool has_list_;
  const CloudLedger& ledger_;
  std::vector<SourceParameters> sources_;
  std::vector<SourceStatistics> reported_;
  std::vector<std::unique_ptr<SourceSubscriber>> subscribers_;
  std::vector<std::string> wrong_types_;  ///< Last error of each source.
  std::vector<bool> is_published_;        ///< Topics without a connection that have a publisher.
  std::string other_topics_;
  std::string topics_;
};

/// Content of one report on a source.
struct SourceReport {
  SourceStatistics statistics;
  std::optional<double> rate_hz;
  std::string topic;  ///< Topic after remapping.
  std::string type;
  std::size_t num_publishers = 0;
  bool is_published = false;       ///< The master knows a publisher.
  std::string wrong_type;          ///< See describeWrongType(); set only before the first message.
  double silence_s = 0.0;          ///< Time since its last message, or since the start of the node.
  bool is_simulated_time = false;  ///< use_sim_time, as with bags.
};

/// The first case that applies:
///   - messages were dropped since the last report: warning with the reason;
///   - the topic is published with another type: error;
///   - no message for maxSilence_s(), unless time is simulated and the publisher has gone: warning;
///   - else: all is well.
[[nodiscard]] ReportSummary summarize(const SourceReport& report,
                                      const SourceStatistics& last_report);

/// Writes a report with one key for each figure.
void fillStatus(const SourceReport& report, const SourceStatistics& last_report,
                diagnostic_updater::DiagnosticStatusWrapper& status);

}  // namespace cuboid_mapping_ros
