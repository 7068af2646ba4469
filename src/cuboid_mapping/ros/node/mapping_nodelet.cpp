// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/node/mapping_nodelet.h"

#include "cuboid_mapping/io/text.h"
#include "cuboid_mapping/ros/map/map_storage.h"
#include "cuboid_mapping/ros/middleware/callbacks.h"
#include "cuboid_mapping/ros/middleware/names.h"
#include "cuboid_mapping/ros/node/mapping_node.h"
#include "cuboid_mapping/ros/parameters/parameters.h"

#include <diagnostic_updater/diagnostic_updater.h>
#include <ros/console.h>

#include <mutex>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace cuboid_mapping_ros {
namespace {

/// @throws std::runtime_error  with all errors.
NodeParameters loadGoodParameters(const ros::NodeHandle& private_nh) {
  const LoadedParameters loaded = loadParameters(private_nh);
  for (const ParameterError& warning : loaded.warnings) {
    ROS_WARN_STREAM_NAMED(kNodeName, "parameter ~" << warning.key << ": " << warning.message);
  }
  if (loaded.errors.empty()) return loaded.parameters;
  std::vector<std::string> texts;
  for (const ParameterError& error : loaded.errors) {
    texts.push_back((error.key == "~" ? "" : "~") + error.key + ' ' + error.message);
  }
  throw std::runtime_error(counted(texts.size(), "bad parameter") + ": " + join(texts, "; "));
}

}  // namespace

/// The status of a node that reads its map, in the place of the node's own. Reports from the queue of the node handle;
/// fail() is thread-safe.
class StartReport {
 public:
  StartReport(const ros::NodeHandle& nh, const ros::NodeHandle& private_nh, std::string file)
      : file_(std::move(file)), updater_(nh, private_nh, private_nh.getNamespace()) {
    updater_.setHardwareID("none");
    updater_.add("mapping", this, &StartReport::report);
    timer_ = Timer(nh, updater_.getPeriod(), [this] { updater_.force_update(); });
  }

  void fail(const std::string& error) {
    const std::lock_guard<std::mutex> lock(mutex_);
    error_ = error;
  }

 private:
  void report(diagnostic_updater::DiagnosticStatusWrapper& status) {
    using diagnostic_msgs::DiagnosticStatus;
    const std::lock_guard<std::mutex> lock(mutex_);
    if (error_.empty()) {
      status.summary(DiagnosticStatus::WARN, "reads " + file_ + ": no cloud is mapped yet");
    } else {
      status.summary(DiagnosticStatus::ERROR, "not started: " + error_);
      status.add("next step", "correct this, and load the nodelet again");
    }
    status.add("map file", file_);
  }

  const std::string file_;
  std::mutex mutex_;
  std::string error_;
  diagnostic_updater::Updater updater_;
  Timer timer_;
};

MappingNodelet::MappingNodelet(Process process) : process_(process) {}

MappingNodelet::~MappingNodelet() {
  if (starting_.joinable()) starting_.join();
}

void MappingNodelet::onInit() {
  try {
    NodeParameters parameters = loadGoodParameters(getPrivateNodeHandle());
    // The command line may name a map to start from, as for octomap_server_node. It does not go
    // through the parameter server, where it would stay for the next node of this name.
    if (getMyArgv().size() == 1) parameters.map_file = getMyArgv().front();
    const auto differences = toDifferenceLines(parameters, {}, "default");
    for (const std::string& line : differences) NODELET_INFO_STREAM(line);
    for (const std::string& line : toSourceLines(parameters)) NODELET_INFO_STREAM(line);
    if (differences.empty()) NODELET_INFO("all parameters have their default values");
    for (const std::string& line : toLogLines(parameters)) NODELET_DEBUG_STREAM(line);
    const StartMap start_map = findStartMap(parameters);
    if (process_ == Process::kOwn || start_map.file.empty()) return start(parameters, start_map);
    startLater(parameters, start_map);
  } catch (const std::exception& exception) {
    NODELET_FATAL_STREAM("not started: " << exception.what());
    throw;  // The nodelet manager reports that it has failed, but not why.
  }
}

void MappingNodelet::startLater(const NodeParameters& parameters, const StartMap& source) {
  NODELET_INFO_STREAM("starts when " << source.file << " is read");
  start_report_ =
      std::make_unique<StartReport>(getNodeHandle(), getPrivateNodeHandle(), source.file);
  starting_ = std::thread([this, parameters, source] {
    std::string error = "for an unknown reason";
    try {
      start(parameters, source);
      return start_report_.reset();
    } catch (const std::exception& exception) {
      error = exception.what();
    } catch (...) {  // Not an exception of ours.
    }
    NODELET_FATAL_STREAM("not started: " << error);
    start_report_->fail(error);
  });
}

void MappingNodelet::start(NodeParameters parameters, const StartMap& source) {
  const double resolution_m = parameters.map.resolution_m;
  const auto start_map = readStartMap(source, parameters);
  if (parameters.autosave_version) {
    NODELET_INFO_STREAM("goes on with the map of autosave_file, " << parameters.autosave_file);
    if (!parameters.map_file.empty() && parameters.map_file != parameters.autosave_file) {
      NODELET_WARN_STREAM("map_file, " << parameters.map_file
                                       << ", is not read: to start with it, remove autosave_file");
    }
  }
  if (parameters.map.resolution_m != resolution_m) {
    NODELET_WARN_STREAM("resolution is " << parameters.map.resolution_m
                                         << " m, that of map_file, not " << resolution_m << " m");
  }
  if (start_map) {
    const std::string other = describeOtherFrame(start_map->frame_id, parameters.frame_id);
    if (!other.empty()) NODELET_WARN_STREAM(other);
  }
  readReferences(parameters, findTextFrom(getPrivateNodeHandle()));
  node_ =
      std::make_unique<MappingNode>(getNodeHandle(), getPrivateNodeHandle(), parameters, start_map);
}

}  // namespace cuboid_mapping_ros
