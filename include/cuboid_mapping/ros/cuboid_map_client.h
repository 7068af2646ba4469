// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"

#include <ros/node_handle.h>
#include <ros/time.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>

/// Everything that uses ROS: clients of the node, and its services.
namespace cuboid_mapping_ros {

/// Follows the map of a node into a map of this process, to be asked with the functions of
/// cuboid_mapping/query/ and no service call. Thread-safe.
///
/// It listens to cuboid_map and cuboid_map_updates in a thread of its own, and asks ~get_map when
/// updates were lost, or the node was started anew. Between two updates the map is that of one
/// revision; the server publishes them at its publish_rate.
class CuboidMapClient {
 public:
  /// Called after each change of the map, in the client's thread, while the map is not held: it may
  /// read, and must not take long. @param changes  The changes, with the revision of the server's map.
  using Callback = std::function<void(const cuboid_mapping::ChangeSet& changes)>;

  /// @param nh  Namespace of the topics.
  /// @param server  Name of the node, for ~get_map; in the namespace of nh unless it begins with /.
  explicit CuboidMapClient(const ros::NodeHandle& nh = ros::NodeHandle(),
                           const std::string& server = "cuboid_mapping", Callback callback = {});
  ~CuboidMapClient();
  CuboidMapClient(const CuboidMapClient&) = delete;
  CuboidMapClient& operator=(const CuboidMapClient&) = delete;

  /// Whether a map has come already.
  [[nodiscard]] bool hasMap() const;
  /// Waits for the first map. Logs the cause if none comes for some seconds, and at the timeout: nobody
  /// publishes the topic. Do not call it from the callback.
  /// @return hasMap(); false after the timeout, or when ROS shuts down.
  [[nodiscard]] bool waitForMap(const ros::WallDuration& timeout) const;
  /// Revision of the server's map that this map equals; 0 before the first map.
  [[nodiscard]] std::uint64_t revision() const;
  /// Stamp of the last cloud in the map.
  [[nodiscard]] ros::Time stamp() const;
  /// Frame of the map; empty before the first.
  [[nodiscard]] std::string frameId() const;

  /// Reads the map, which does not change meanwhile; it is empty before the first one has come.
  /// Threads that read without a pause do not keep updates out.
  /// @param work  (const CuboidMap&) -> any.
  template <typename WorkT>
  auto read(const WorkT& work) const {
    const ReadLock lock(*this);
    return work(map());
  }

 private:
  struct Implementation;

  /// Keeps the map as it is while it lives.
  class ReadLock {
   public:
    explicit ReadLock(const CuboidMapClient& client);
    ~ReadLock();
    ReadLock(const ReadLock&) = delete;
    ReadLock& operator=(const ReadLock&) = delete;

   private:
    const Implementation& implementation_;
    int generation_;
  };

  [[nodiscard]] const cuboid_mapping::CuboidMap& map() const;

  std::unique_ptr<Implementation> implementation_;
};

}  // namespace cuboid_mapping_ros
