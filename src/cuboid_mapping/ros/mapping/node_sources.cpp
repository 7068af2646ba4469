// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/mapping/node_sources.h"

#include "cuboid_mapping/io/text.h"
#include "cuboid_mapping/ros/mapping/source_subscriber.h"
#include "cuboid_mapping/ros/middleware/published_topics.h"

#include <ros/console.h>
#include <ros/this_node.h>
#include <ros/time.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <optional>
#include <set>

namespace cuboid_mapping_ros {

namespace {

/// Topics of a type, without those that this process publishes.
std::set<std::string> findTopics(const std::map<std::string, std::string>& types,
                                 const std::string& datatype) {
  std::set<std::string> found;
  for (const auto& [topic, type] : types) {
    if (type == datatype) found.insert(topic);
  }
  std::vector<std::string> own;
  ros::this_node::getAdvertisedTopics(own);
  for (const std::string& topic : own) found.erase(topic);
  return found;
}

}  // namespace

NodeSources::NodeSources(const NodeParameters& parameters, const CloudLedger& ledger)
    : has_list_(!parameters.sources.empty()),
      ledger_(ledger),
      sources_(sourcesOf(parameters)),
      reported_(sources_.size()),
      wrong_types_(sources_.size()),
      is_published_(sources_.size()) {}

void NodeSources::listen(const ros::NodeHandle& nh, const SourceSubscriber::Callbacks& callbacks) {
  for (std::size_t i = 0; i < sources_.size(); ++i) {
    subscribers_.push_back(std::make_unique<SourceSubscriber>(nh, at(i), i, callbacks));
    topics_ += (i == 0 ? "" : ", ") + subscribers_.back()->topic();
  }
}

std::size_t NodeSources::numPublishers() const {
  std::size_t count = 0;
  for (const auto& subscriber : subscribers_) count += subscriber->numPublishers();
  return count;
}

std::string NodeSources::findWrongTypes() {
  const std::vector<CloudLedger::Source> noted = ledger_.figures().sources;
  std::optional<std::map<std::string, std::string>> types;
  std::set<std::string> others;
  for (std::size_t i = 0; i < subscribers_.size(); ++i) {
    const SourceSubscriber& subscriber = *subscribers_[i];
    std::string wrong;
    if (noted.at(i).statistics.num_received == 0 && subscriber.numPublishers() == 0) {
      if (!types) types = publishedTypes();
      const auto published = types->find(subscriber.topic());
      is_published_[i] = published != types->end();
      if (is_published_[i])
        wrong = describeWrongType(at(i), subscriber.topic(), published->second);
      else
        others.merge(findTopics(*types, datatypeOf(at(i).type, subscriber.topic())));
    }
    if (!wrong.empty() && wrong != wrong_types_[i]) ROS_ERROR_STREAM(wrong);
    wrong_types_[i] = wrong;
  }
  other_topics_ = cuboid_mapping::join(others, ", ");
  std::vector<std::string> found;
  std::copy_if(wrong_types_.begin(), wrong_types_.end(), std::back_inserter(found),
               [](const std::string& text) { return !text.empty(); });
  return join(found, "; ");
}

void NodeSources::addDiagnostics(diagnostic_updater::Updater& diagnostics) {
  if (!has_list_) return;
  for (std::size_t i = 0; i < sources_.size(); ++i) {
    diagnostics.add(
        "source " + nameOf(at(i)),
        [this, i](diagnostic_updater::DiagnosticStatusWrapper& status) { report(i, status); });
  }
}

void NodeSources::report(std::size_t source, diagnostic_updater::DiagnosticStatusWrapper& status) {
  if (source >= subscribers_.size()) return;  // The node starts or stops, or merges robots.
  const CloudLedger::Source noted = ledger_.figures().sources.at(source);
  SourceReport report;
  report.statistics = noted.statistics;
  report.rate_hz = noted.rate_hz;
  report.topic = subscribers_[source]->topic();
  report.type = toString(at(source).type);
  report.num_publishers = subscribers_[source]->numPublishers();
  report.wrong_type = wrong_types_[source];
  report.is_published = is_published_[source];
  report.silence_s = silenceOf(noted, report.num_publishers);
  report.is_simulated_time = ros::Time::isSimTime();
  fillStatus(report, reported_[source], status);
  reported_[source] = noted.statistics;
}

ReportSummary summarize(const SourceReport& report, const SourceStatistics& last_report) {
  const SourceStatistics& now = report.statistics;
  const std::uint64_t num_dropped = now.num_dropped - last_report.num_dropped;
  if (num_dropped > 0) {
    return {ReportLevel::kWarning, counted(num_dropped, "message") + " dropped: " + now.last_drop};
  }
  if (!report.wrong_type.empty()) return {ReportLevel::kError, report.wrong_type};
  if (isStuck(now, last_report)) {
    return {ReportLevel::kWarning, counted(now.numWaiting(), "message") +
                                       " of it wait, and none enters the map: see the log"};
  }
  const bool has_ended = report.is_simulated_time && report.num_publishers == 0;
  if (report.silence_s > maxSilence_s(report.rate_hz, now.num_inserted) && !has_ended) {
    return {ReportLevel::kWarning,
            "no " + report.type + " on " + report.topic +
                (now.num_received == 0
                     ? " yet"
                     : " for " + std::to_string(static_cast<int>(report.silence_s)) + " s") +
                describeUnheard(report.num_publishers, report.is_published,
                                "check the topic and that the sensor is running")};
  }
  return {ReportLevel::kOk, counted(now.num_inserted, "message") + " in the map"};
}

void fillStatus(const SourceReport& report, const SourceStatistics& last_report,
                diagnostic_updater::DiagnosticStatusWrapper& status) {
  const ReportSummary summary = summarize(report, last_report);
  status.summary(static_cast<unsigned char>(summary.level), summary.message);
  status.add("topic", report.topic);
  status.add("type", report.type);
  status.add("messages received", report.statistics.num_received);
  status.add("messages inserted", report.statistics.num_inserted);
  status.add("messages dropped", report.statistics.num_dropped);
  if (report.statistics.num_empty > 0) status.add("messages empty", report.statistics.num_empty);
  if (report.statistics.num_ignored > 0) {
    status.add("messages ignored, max_rate", report.statistics.num_ignored);
  }
  if (report.rate_hz) status.addf("rate [Hz]", "%.2f", *report.rate_hz);
}

}  // namespace cuboid_mapping_ros
