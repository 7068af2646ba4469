// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/fleet/merge_progress.h"

#include <nlohmann/json.hpp>

#include <stdexcept>

namespace cuboid_mapping_ros {

using cuboid_mapping::MergeProgress;
using nlohmann::json;

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

}  // namespace cuboid_mapping_ros
