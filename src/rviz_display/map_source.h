// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/ros/cuboid_map_client.h"

#include <future>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

namespace cuboid_mapping_rviz {

/// The map of a display: followed from a node, or read from a file.
class MapSource {
 public:
  virtual ~MapSource() = default;

  /// Changes since the last call. Does not block.
  [[nodiscard]] virtual std::vector<cuboid_mapping::ChangeSet> takeChanges() = 0;
  /// Reads the map, which does not change meanwhile; an empty map until there is one.
  virtual void read(const std::function<void(const cuboid_mapping::CuboidMap&)>& work) const = 0;
  /// Frame of the map; empty when it is not known.
  [[nodiscard]] virtual std::string frameId() const = 0;
  /// Stamp of the last cloud in the map; zero when it has none.
  [[nodiscard]] virtual ros::Time stamp() const { return {}; }
  /// Reason why there is no map; empty if there is one.
  [[nodiscard]] virtual std::string fault() const = 0;
};

/// Follows the topics cuboid_map and cuboid_map_updates of a namespace, as CuboidMapClient does.
class FollowedMap : public MapSource {
 public:
  /// @param server  Name of the node, for ~get_map.
  FollowedMap(const std::string& topic_namespace, const std::string& server);

  [[nodiscard]] std::vector<cuboid_mapping::ChangeSet> takeChanges() override;
  void read(const std::function<void(const cuboid_mapping::CuboidMap&)>& work) const override;
  [[nodiscard]] std::string frameId() const override { return client_.frameId(); }
  [[nodiscard]] ros::Time stamp() const override { return client_.stamp(); }
  [[nodiscard]] std::string fault() const override;

 private:
  std::string topic_;
  std::mutex mutex_;
  std::vector<cuboid_mapping::ChangeSet> changes_;
  cuboid_mapping_ros::CuboidMapClient client_;  ///< Last member: its callback uses the others.
};

/// Reads a file of any readable format, in a thread of its own.
class FileMap : public MapSource {
 public:
  explicit FileMap(const std::string& file);

  [[nodiscard]] std::vector<cuboid_mapping::ChangeSet> takeChanges() override;
  void read(const std::function<void(const cuboid_mapping::CuboidMap&)>& work) const override;
  [[nodiscard]] std::string frameId() const override { return loaded_.frame_id; }
  [[nodiscard]] std::string fault() const override { return loaded_.fault; }

 private:
  struct Loaded {
    std::unique_ptr<cuboid_mapping::CuboidMap> map;
    std::string frame_id;
    std::string fault;
  };
  static Loaded load(const std::string& file);

  Loaded loaded_;
  std::future<Loaded> loading_;
};

}  // namespace cuboid_mapping_rviz
