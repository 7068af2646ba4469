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

/// Code that uses ROS: clients of the node, and its services.
namespace cuboid_mapping_ros {

/// Keeps a copy of a node's map in this process, for the functions of cuboid_mapping/query/ without service
/// calls. Thread-safe.
///
/// It listens to cuboid_map and cuboid_map_updates in a thread of its own, and calls ~get_map when updates were
/// lost, or the node has restarted. Between two updates the map is that of one revision; the server sends
/// updates at its publish_rate.
class CuboidMapClient {
 public:
  /// Called after each change of the map, in the client's thread, without a lock: it may call read(), and must
  /// not take long. @param changes  The changes, with the revision of the server's map.
  using Callback = std::function<void(const cuboid_mapping::ChangeSet& changes)>;

  /// @param nh  Namespace of the topics.
  /// @param server  Name of the node, in the namespace of nh unless it begins with /. If several nodes publish,
  ///                the client follows this one, else the first that it hears.
  /// @param callback  May be empty.
  explicit CuboidMapClient(const ros::NodeHandle& nh = ros::NodeHandle(),
                           const std::string& server = "cuboid_mapping", Callback callback = {});
  ~CuboidMapClient();
  CuboidMapClient(const CuboidMapClient&) = delete;
  CuboidMapClient& operator=(const CuboidMapClient&) = delete;

  /// Whether the first map has come.
  [[nodiscard]] bool hasMap() const;
  /// Waits for the first map. If none comes for some seconds, and at the timeout, logs whether the topic has a
  /// publisher. Do not call it from the callback.
  /// @return hasMap(); false after the timeout, or when ROS shuts down.
  [[nodiscard]] bool waitForMap(const ros::WallDuration& timeout) const;
  /// Revision of the server's map that the copy equals; 0 before the first map.
  [[nodiscard]] std::uint64_t revision() const;
  /// Stamp of the last cloud in the map; 0 before the first map.
  [[nodiscard]] ros::Time stamp() const;
  /// Frame of the map; empty before the first.
  [[nodiscard]] std::string frameId() const;

  /// Reads the map, which does not change meanwhile; it is empty before the first map. Readers without a pause
  /// do not block updates.
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
