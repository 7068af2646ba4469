// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/files/map_files.h"

#include "cuboid_mapping/io/file_replacement.h"
#include "cuboid_mapping/io/map_files.h"
#include "cuboid_mapping/io/text.h"
#include "cuboid_mapping/ros/middleware/names.h"
#include "cuboid_mapping/ros/parameters/parameter_table.h"
#include "cuboid_mapping/ros/queries/service_call.h"

#include <ros/console.h>

#include <exception>
#include <filesystem>
#include <stdexcept>

namespace cuboid_mapping_ros {
namespace {

std::pair<std::uint64_t, std::vector<CellBox>> stateOf(const GuardedMap& map) {
  return map.read([](const CuboidMap& content) {
    return std::pair(content.revision(), content.lockedBoxes());
  });
}

/// The path with the working folder before a relative name: callers do not know that folder.
std::string toAbsolute(const std::string& file) {
  std::error_code error;
  const std::filesystem::path path = std::filesystem::absolute(file, error);
  return error ? file : path.string();
}

bool isGone(const std::string& file) {
  std::error_code ignored;
  return !std::filesystem::exists(file, ignored);
}

void logAnswer(const char* action, const std::string& file, const StorageAnswer& answer) {
  if (answer.error.empty()) {
    ROS_INFO_STREAM_NAMED(kNodeName, "map " << action << ' ' << file << ": "
                                            << counted(answer.num_cuboids, "cuboid") << ", "
                                            << counted(answer.num_bytes, "byte"));
  } else {
    ROS_ERROR_STREAM_NAMED(kNodeName, "map not " << action << ' ' << file << ": " << answer.error);
  }
}

}  // namespace

MapFiles::MapFiles(const MapHost& host)
    : host_(host),
      map_(host.map),
      frame_id_(host.parameters.frame_id),
      limits_(limitsOfMachine()),
      autosave_file_(toAbsolute(host.parameters.autosave_file)),
      autosave_version_(host.parameters.autosave_version),
      window_file_(host.parameters.window.keeps() ? toAbsolute(host.parameters.window.file) : "") {
  if (autosave_version_) lockAsSaved(map_, autosave_file_);
  saved_ = stateOf(map_);
  const ros::NodeHandle& nh = host.services_nh;
  servers_ = {
      offerService<SaveMap>(nh, kSaveMapService,
                            [this](const auto& request, auto& response) {
                              const std::lock_guard<std::mutex> lock(work_mutex_);
                              onSave(request, response);
                            }),
      offerService<LoadMap>(nh, kLoadMapService, [this](const auto& request, auto& response) {
        const std::lock_guard<std::mutex> lock(work_mutex_);
        onLoad(request, response);
      })};
  if (!autosave_file_.empty()) announceAutosave();
  if (!autosave_file_.empty() || !window_file_.empty()) {
    autosave_timer_ = Timer(nh, host.parameters.autosave_period_s, [this] {
      const std::lock_guard<std::mutex> lock(work_mutex_);
      autosave();
    });
  }
}

MapFiles::~MapFiles() {
  host_.guard.run("autosave at the end", [this] { autosave(); });
}

void MapFiles::onSave(const SaveMap::Request& request, SaveMap::Response& response) {
  const std::string file = toAbsolute(request.filename);
  const StorageAnswer answer = saveMap(map_, frame_id_, file, limits_, endWhen(host_.is_stopping));
  logAnswer("saved to", file, answer);
  response.info = makeInfo(map_, frame_id_, answer.error);
  if (answer.error.empty()) {
    noteOwn(file);
    response.info.revision = answer.revision;
    response.info.message = "saved to " + file;
    if (answer.num_cuboids == 0) {
      response.info.message +=
          "; the map is empty: no cloud has got into it since the start or ~reset, see the log or "
          "/diagnostics";
      ROS_WARN_STREAM_NAMED(kNodeName, response.info.message);
    }
  }
  response.cuboids = answer.num_cuboids;
  response.bytes = answer.num_bytes;
}

void MapFiles::onLoad(const LoadMap::Request& request, LoadMap::Response& response) {
  const std::string file = toAbsolute(request.filename);
  const StorageAnswer answer = load(file, request);
  logAnswer("loaded from", file, answer);
  if (!answer.notes.empty()) ROS_WARN_STREAM_NAMED(kNodeName, file << ": " << answer.notes);
  response.info = makeInfo(map_, frame_id_, answer.error);
  if (answer.error.empty()) {
    noteOwn(file);
    response.info.message = "loaded from " + file;
  }
  if (answer.error.empty() && request.rule == LoadMap::Request::REPLACE) host_.note_replaced();
  if (!answer.notes.empty()) response.info.message += "; " + answer.notes;
  response.cuboids = answer.num_cuboids;
}

StorageAnswer MapFiles::load(const std::string& file, const LoadMap::Request& request) {
  LoadPlacement placement;
  placement.frame_id = frame_id_;
  switch (request.rule) {
    case LoadMap::Request::REPLACE: break;
    case LoadMap::Request::SUM: placement.rule = MergeRule::kSum; break;
    case LoadMap::Request::LATER: placement.rule = MergeRule::kLater; break;
    case LoadMap::Request::OCCUPIED: placement.rule = MergeRule::kOccupied; break;
    default:
      StorageAnswer answer;
      answer.error = "rule is " + std::to_string(request.rule) +
                     ": use REPLACE (0), SUM (1), LATER (2) or OCCUPIED (3)";
      return answer;
  }
  if (request.transform != geometry_msgs::Transform()) {
    placement.T_map_file = toIsometry(request.transform);
  }
  return loadMap(map_, file, limits_, placement, endWhen(host_.is_stopping));
}

void MapFiles::autosave() {
  // Diagnostics count this failure, too, but not at the end of the node.
  if (const std::string error = map_.save(); !error.empty()) {
    ROS_ERROR_STREAM_NAMED(kNodeName, "map not saved to " << window_file_ << ": " << error);
  }
  auto state = stateOf(map_);
  const bool has_window = !window_file_.empty();
  const bool is_lost = has_window ? isGone(window_file_) : autosave_version_ && !isOwn();
  if (state == saved_ && !is_lost) return;
  std::string error;
  if (has_window && is_lost) {
    error = window_file_ +
            " was removed or renamed, and the map in it ends with this node: call ~save_map";
    ROS_ERROR_STREAM_NAMED(kNodeName, error);
  } else if (has_window) {
    error = trySaveLocks(window_file_);
  } else if (!autosave_file_.empty()) {
    error = saveToAutosaveFile();
  }
  if (error.empty()) saved_ = std::move(state);
  const std::lock_guard<std::mutex> lock(error_mutex_);
  autosave_error_ = error;
}

std::string MapFiles::saveToAutosaveFile() {
  chooseAutosaveFile();
  const StorageAnswer answer = saveMap(map_, frame_id_, autosave_file_, limits_);
  logAnswer("saved to", autosave_file_, answer);
  if (!answer.error.empty()) return answer.error;
  noteOwn(autosave_file_);
  return trySaveLocks(autosave_file_);
}

std::string MapFiles::trySaveLocks(const std::string& map_file) {
  try {
    saveLocks(map_, map_file);
    return {};
  } catch (const std::exception& exception) {
    ROS_ERROR_STREAM_NAMED(kNodeName, "locked boxes not saved: " << exception.what());
    return exception.what();
  }
}

void MapFiles::noteOwn(const std::string& file) {
  std::error_code ignored;
  if (!std::filesystem::equivalent(file, autosave_file_, ignored)) return;
  autosave_version_ = versionOf(autosave_file_);
}

bool MapFiles::isOwn() const {
  return autosave_version_ && versionOf(autosave_file_) == autosave_version_;
}

void MapFiles::chooseAutosaveFile() {
  if (isOwn()) return;
  try {
    if (!hasMap(autosave_file_)) return;
  } catch (const MapFileError& error) {
    ROS_WARN_STREAM_NAMED(kNodeName, error.what());
  }
  const std::string old = std::exchange(autosave_file_, nameBeside(autosave_file_));
  autosave_version_.reset();
  ROS_WARN_STREAM_NAMED(
      kNodeName, old << " holds a map that this node has not read, such as that of another node "
                        "with this autosave_file, and stays: saves go to "
                     << autosave_file_ << ". To replace it, remove it before the start");
}

void MapFiles::announceAutosave() {
  chooseAutosaveFile();
  try {
    if (!formatOfName(autosave_file_)) {
      throw std::runtime_error(autosave_file_ + " must end in one of " + knownEndings());
    }
    checkReplaceable(autosave_file_);
  } catch (const std::exception& exception) {
    autosave_error_ = exception.what();
    ROS_ERROR_STREAM_NAMED(kNodeName,
                           "the map cannot be saved to autosave_file: " << exception.what());
  }
}

void MapFiles::report(NodeReport& report) {
  const std::lock_guard<std::mutex> lock(error_mutex_);
  report.autosave_error = autosave_error_;
}

std::vector<ParameterDeclaration> MapFiles::declare() {
  using P = NodeParameters;
  return {
      {"autosave_file", "", file(&P::autosave_file),
       "The map is saved to this file after changes and when the node stops. If the file exists, "
       "the node starts with its map and its locked boxes, and does not start if it cannot be "
       "read, or has another resolution. The extension selects the format, as with ~save_map; "
       "with merge/robots it must be .sqlite. Not with window/outside: keep, which saves to "
       "window/file. Empty: the map is not saved."},
      {"autosave_period", "s", number(&P::autosave_period_s, 1.0, 86400.0),
       "Time between two saves to autosave_file, or to window/file."},
  };
}

std::vector<ParameterError> MapFiles::check(const LoadedParameters& loaded) {
  const NodeParameters& parameters = loaded.parameters;
  const std::string& file = parameters.autosave_file;
  if (file.empty()) return {};
  std::vector<ParameterError> errors;
  if (parameters.window.keeps()) {
    errors.push_back({"autosave_file",
                      "does not go with window/outside: keep, which saves to window/file: remove "
                      "it; ~save_map or map_convert makes a copy"});
  }
  if (!parameters.robots.empty() && formatOfName(file) != MapFormat::kStore) {
    errors.push_back({"autosave_file",
                      "must end in .sqlite with merge/robots: such a file also keeps which "
                      "observations are merged"});
  }
  return errors;
}

}  // namespace cuboid_mapping_ros
