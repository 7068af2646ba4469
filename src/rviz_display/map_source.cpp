// SPDX-License-Identifier: BSD-3-Clause
#include "map_source.h"

#include "cuboid_mapping/io/map_files.h"

#include <chrono>
#include <exception>
#include <utility>

namespace cuboid_mapping_rviz {

using cuboid_mapping::ChangeSet;
using cuboid_mapping::CuboidMap;

FollowedMap::FollowedMap(const std::string& topic_namespace, const std::string& server)
    : topic_(ros::NodeHandle(topic_namespace).resolveName("cuboid_map")),
      client_(ros::NodeHandle(topic_namespace), server, [this](const ChangeSet& changes) {
        const std::lock_guard<std::mutex> lock(mutex_);
        if (changes.is_everything) changes_.clear();
        changes_.push_back(changes);
      }) {}

std::vector<ChangeSet> FollowedMap::takeChanges() {
  const std::lock_guard<std::mutex> lock(mutex_);
  return std::exchange(changes_, {});
}

void FollowedMap::read(const std::function<void(const CuboidMap&)>& work) const {
  client_.read(work);
}

std::string FollowedMap::fault() const {
  return client_.instance() != 0 ? "" : "no map has come on " + topic_;
}

FileMap::FileMap(const std::string& file)
    : loaded_{nullptr, "", "reading " + file},
      loading_(std::async(std::launch::async, load, file)) {}

FileMap::Loaded FileMap::load(const std::string& file) {
  Loaded loaded;
  try {
    const cuboid_mapping::MapSnapshot snapshot = cuboid_mapping::readMapFile(file).snapshot;
    cuboid_mapping::MapConfig config;
    config.resolution_m = snapshot.resolution_m;
    auto map = std::make_unique<CuboidMap>(config);
    restoreSnapshot(snapshot, *map);
    loaded.map = std::move(map);
    loaded.frame_id = snapshot.frame_id;
  } catch (const std::exception& exception) {
    loaded.fault = exception.what();
  }
  return loaded;
}

std::vector<ChangeSet> FileMap::takeChanges() {
  const bool is_loaded =
      loading_.valid() && loading_.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
  if (!is_loaded) return {};
  loaded_ = loading_.get();
  ChangeSet everything;
  everything.is_everything = true;
  return {everything};
}

void FileMap::read(const std::function<void(const CuboidMap&)>& work) const {
  static const CuboidMap kNothing;
  work(loaded_.map ? *loaded_.map : kNothing);
}

}  // namespace cuboid_mapping_rviz
