// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/fleet/robot_merger.h"

#include "cuboid_mapping/GetObservations.h"
#include "cuboid_mapping/io/scan_update_codec.h"
#include "cuboid_mapping/io/text.h"
#include "cuboid_mapping/ros/middleware/names.h"
#include "cuboid_mapping/ros/middleware/published_topics.h"
#include "cuboid_mapping/ros/middleware/tf_lookup.h"

#include <diagnostic_msgs/DiagnosticStatus.h>
#include <ros/console.h>
#include <nlohmann/json.hpp>

#include <exception>
#include <stdexcept>
#include <string_view>
#include <utility>

namespace cuboid_mapping_ros {
namespace {

using nlohmann::json;

constexpr double kApplyPeriod_s = 0.05;
constexpr double kAskPeriod_s = 0.5;
/// Maximum number of received observations in the queue.
constexpr std::uint32_t kObservationsKept = 1000;

double mergeTime_s() { return ros::SteadyTime::now().toSec(); }

/// JSON for MapSnapshot::progress: {"newest_stamp_ns": ..., "sessions": [{"robot": "/robot1", "session": ...,
/// "left_out": 0, "applied": [[1, 24], [26, 40]]}]}.
std::string toText(const MergeProgress& progress) {
  json sessions = json::array();
  for (const MergeProgress::Session& session : progress.sessions) {
    json runs = json::array();
    for (const auto& [first, last] : session.applied.runs()) runs.push_back({first, last});
    sessions.push_back({{"robot", session.robot},
                        {"session", session.session},
                        {"left_out", session.left_out},
                        {"applied", runs}});
  }
  return json{{"newest_stamp_ns", progress.newest_stamp_ns}, {"sessions", sessions}}.dump();
}

/// Inverse of toText(); an empty text gives the progress of an empty map.
/// @throws std::runtime_error  for an invalid text.
MergeProgress mergeProgressOfText(const std::string& text) {
  MergeProgress progress;
  if (text.empty()) return progress;
  try {
    const json read = json::parse(text);
    progress.newest_stamp_ns = read.at("newest_stamp_ns");
    for (const json& item : read.at("sessions")) {
      MergeProgress::Session session{item.at("robot"), item.at("session"), item.at("left_out"), {}};
      std::map<std::uint64_t, std::uint64_t> runs;
      for (const json& run : item.at("applied")) runs[run.at(0)] = run.at(1);
      if (!session.applied.setRuns(runs)) throw std::runtime_error("runs that are not in order");
      progress.sessions.push_back(std::move(session));
    }
  } catch (const std::exception& error) {
    throw std::runtime_error(std::string("the list of merged observations cannot be read: ") +
                             error.what());
  }
  return progress;
}

}  // namespace

std::variant<RobotObservation, std::string> readObservation(const Observation& message,
                                                            const NodeParameters& parameters) {
  const std::string from =
      "observation " + std::to_string(message.sequence) + " of " + message.robot;
  const std::string frame_id = withoutSlash(parameters.frame_id);
  if (withoutSlash(message.header.frame_id) != frame_id) {
    return from + " is in frame '" + message.header.frame_id + "', the map in '" + frame_id +
           "': all robots need the same frame_id";
  }
  if (message.resolution != parameters.map.resolution_m) {
    return from + " has a resolution of " + cuboid_mapping::toText(message.resolution) +
           " m, the map one of " + cuboid_mapping::toText(parameters.map.resolution_m) +
           " m: they must be equal";
  }
  MapConfig config = parameters.map;
  config.sensor_model = {message.hit, message.miss, message.min, message.max};
  const std::string_view bytes(reinterpret_cast<const char*>(message.data.data()),
                               message.data.size());
  auto update = scanUpdateOfBytes(bytes);
  if (!update || message.sequence == 0 || !checkConfig(config).empty()) return from + " is damaged";
  return RobotObservation{message.robot,
                          message.session,
                          message.sequence,
                          message.left_out,
                          static_cast<std::int64_t>(message.header.stamp.toNSec()),
                          config.sensor_model,
                          std::move(*update)};
}

ros::Time stampOf(const RobotObservation& observation) {
  ros::Time stamp;
  stamp.fromNSec(static_cast<std::uint64_t>(observation.stamp_ns));
  return stamp;
}

RobotMerger::RobotMerger(const ros::NodeHandle& nh, const ros::NodeHandle& asking_nh,
                         const NodeParameters& parameters, GuardedMap& map, Callbacks callbacks)
    : asking_nh_(asking_nh),
      parameters_(parameters),
      map_(map),
      callbacks_(std::move(callbacks)),
      order_(parameters.of<MergeParameters>().delay_s) {
  const std::string earlier =
      map_.read([this](const CuboidMap& /*map*/) { return map_.progress(); });
  order_.start(mergeProgressOfText(earlier), mergeTime_s());
  map_.setProgress([this] { return progress(); });
  for (const std::string& robot : parameters.robots) {
    subscribers_.push_back(
        subscribeTo<Observation>(nh, robot + '/' + kObservationsTopic, kObservationsKept,
                                 [this, robot](const auto& message) { take(robot, *message); }));
  }
  apply_timer_ = Timer(nh, kApplyPeriod_s, [this] { applyDue(); });
  ask_timer_ = Timer(asking_nh_, kAskPeriod_s, [this] { ask(); });
}

RobotMerger::~RobotMerger() {
  stopAsking();
  map_.setProgress([text = progress()] { return text; });
  removePosted(*asking_nh_.getCallbackQueue(), this);
}

void RobotMerger::report(NodeReport& report) const {
  for (const ros::Subscriber& subscriber : subscribers_) {
    report.cloud_topic += (report.cloud_topic.empty() ? "" : " ") + subscriber.getTopic();
    report.num_publishers += subscriber.getNumPublishers();
  }
  if (report.num_publishers > 0) return;
  const auto types = publishedTypes();
  for (const ros::Subscriber& subscriber : subscribers_) {
    if (types.count(subscriber.getTopic()) > 0) report.is_published = true;
  }
}

void RobotMerger::take(const std::string& robot, const Observation& message) {
  constexpr double kLogPeriod_s = 10.0;
  auto read = readObservation(message, parameters_);
  const std::lock_guard<std::mutex> lock(mutex_);
  if (auto* observation = std::get_if<RobotObservation>(&read)) {
    order_.put(std::move(*observation), mergeTime_s());
    return;
  }
  ++num_refused_;
  Refusal& refusal = refusals_[robot];
  refusal.text = std::get<std::string>(read);
  if (mergeTime_s() < refusal.log_again_s) return;
  refusal.log_again_s = mergeTime_s() + kLogPeriod_s;
  ROS_WARN_STREAM_NAMED(kNodeName, refusal.text);
}

void RobotMerger::applyDue() {
  std::vector<RobotObservation> due;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    due = order_.takeDue(mergeTime_s());
  }
  std::exception_ptr failure;  // A failure must not keep other observations out of the map.
  for (const RobotObservation& observation : due) {
    try {
      apply(observation);
    } catch (...) {
      failure = std::current_exception();
      const std::lock_guard<std::mutex> lock(mutex_);
      ++num_failed_;
    }
  }
  if (failure) std::rethrow_exception(failure);
}

void RobotMerger::apply(const RobotObservation& observation) {
  const bool is_paused = callbacks_.is_paused();
  if (!is_paused) {
    if (map_.config().sensor_model != observation.sensor_model) {
      map_.edit([&](CuboidMap& map) { return map.setSensorModel(observation.sensor_model); });
    }
    map_.change(stampOf(observation), [&](CuboidMap& map) {
      auto changes = map.apply(observation.update);
      noteApplied(observation);
      return changes;
    });
  } else {
    noteApplied(observation);
  }
  callbacks_.note(observation, !is_paused);
}

std::string RobotMerger::progress() {
  const std::lock_guard<std::mutex> lock(mutex_);
  return toText(order_.progress());
}

void RobotMerger::noteApplied(const RobotObservation& observation) {
  const std::lock_guard<std::mutex> lock(mutex_);
  order_.noteApplied(observation);
}

void RobotMerger::ask() {
  const std::lock_guard<std::mutex> lock(mutex_);
  for (const ObservationQuestion& question : order_.findQuestions(mergeTime_s())) {
    if (asked_.count(question.robot) > 0) continue;
    post(*asking_nh_.getCallbackQueue(), this, [this, question] { askFor(question); });
    asked_.insert(question.robot);
  }
}

void RobotMerger::askFor(const ObservationQuestion& question) {
  struct Asking {  // Lives until there is an answer or an exception.
    ~Asking() {
      const std::lock_guard<std::mutex> lock(merger.mutex_);
      merger.asked_.erase(robot);
    }
    RobotMerger& merger;
    const std::string& robot;
  };
  const Asking asking{*this, question.robot};
  GetObservations service;
  service.request.session = question.session;
  service.request.first = question.first;
  // A robot that does not answer is asked again later.
  if (!calls_.call(asking_nh_, question.robot + '/' + kGetObservationsService, service)) return;
  if (service.response.session != question.session) service.response.complete_to = 0;
  for (const Observation& observation : service.response.observations) {
    take(question.robot, observation);
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  num_asked_for_ += service.response.observations.size();
  order_.noteAnswered(question, service.response.complete_to);
}

void RobotMerger::fillStatus(diagnostic_updater::DiagnosticStatusWrapper& status) {
  using diagnostic_msgs::DiagnosticStatus;
  const std::lock_guard<std::mutex> lock(mutex_);
  const MergeCounts counts = order_.counts();
  status.summary(DiagnosticStatus::OK, counted(counts.num_received, "observation") + " of " +
                                           counted(counts.num_sessions, "session"));
  for (const ros::Subscriber& subscriber : subscribers_) {
    if (subscriber.getNumPublishers() > 0) continue;
    status.summary(DiagnosticStatus::WARN,
                   "nobody publishes " + subscriber.getTopic() +
                       ": start that robot's node, or correct merge/robots");
  }
  if (counts.num_missing > 0 && counts.num_missing >= reported_.num_missing) {
    status.summary(
        DiagnosticStatus::WARN,
        counted(counts.num_missing, "observation") +
            " missing: give the robots' nodes observation_memory, so that they can be asked");
  }
  if (counts.num_late > reported_.num_late) {
    status.summary(DiagnosticStatus::WARN,
                   "observations of " + counts.late_robot + " are " + describeAge(counts.late_s) +
                       " older than the newest: synchronize the robots' clocks (chrony, ntp), or "
                       "raise merge/delay if messages take so long");
  }
  if (counts.num_left_out > reported_.num_left_out) {
    status.summary(DiagnosticStatus::WARN,
                   "robots leave out clouds: their observation_rate does not suffice");
  }
  std::vector<std::string> refusals;  // Since the last report.
  for (auto& [robot, refusal] : refusals_) {
    if (!refusal.text.empty()) refusals.push_back(std::exchange(refusal.text, ""));
  }
  if (!refusals.empty()) {
    status.summary(DiagnosticStatus::WARN, cuboid_mapping::join(refusals, "; "));
  }
  status.add("observations received", counts.num_received);
  status.add("observations waiting", counts.num_waiting);
  status.add("observations late", counts.num_late);
  status.add("observations missing", counts.num_missing);
  status.add("clouds left out", counts.num_left_out);
  status.add("observations repeated", counts.num_repeated);
  status.add("observations refused", num_refused_);
  status.add("observations that failed", num_failed_);
  status.add("observations asked for", num_asked_for_);
  status.add("sessions", counts.num_sessions);
  reported_ = counts;
}

}  // namespace cuboid_mapping_ros
