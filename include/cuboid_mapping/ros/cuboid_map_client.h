// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/sharing/map_follower.h"

#include <ros/node_handle.h>
#include <ros/time.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>

/// Code that uses ROS: clients of the node, and its services.
namespace cuboid_mapping_ros {

/// One revision of a node's map. It does not change while it is held, however long: updates go into another one.
class ClientMap {
 public:
  /// @param version  Map and labels of this revision; never null.
  explicit ClientMap(std::shared_ptr<const cuboid_mapping::MapFollower> version)
      : version_(std::move(version)) {}

  /// The map; empty before the first. Its own revision() is not the server's. Keep the ClientMap while you use the
  /// reference.
  [[nodiscard]] const cuboid_mapping::CuboidMap& map() const;
  /// Revision of the server's map that this one equals; 0 before the first map.
  [[nodiscard]] std::uint64_t revision() const { return version_->revision(); }
  /// Number of the server's run, which changes when it restarts; 0 before the first map.
  [[nodiscard]] std::uint64_t instance() const { return version_->instance(); }
  /// Times that a reset, load, move or correction has replaced the server's map in this run.
  [[nodiscard]] std::uint64_t replacements() const { return version_->label().num_replaced; }
  /// Stamp of the last cloud in the map; 0 before the first.
  [[nodiscard]] ros::Time stamp() const;
  /// Frame of the map; empty before the first.
  [[nodiscard]] const std::string& frameId() const { return version_->label().frame_id; }

 private:
  std::shared_ptr<const cuboid_mapping::MapFollower> version_;
};

/// Keeps a copy of a node's map in this process, for the functions of cuboid_mapping/query/ without service
/// calls. Thread-safe.
///
/// It listens to cuboid_map and cuboid_map_updates in a thread of its own, and calls ~get_map when updates were
/// lost, or the node has restarted. Updates come at the server's publish_rate. A reader keeps a revision as it is,
/// and holds up neither updates nor other readers. While somebody reads, a second map takes the updates.
class CuboidMapClient {
 public:
  /// Called after each change of the map, in the client's thread, without a lock: it may call read(), and must
  /// not take long. @param changes  The changes, with the revision of the server's map.
  using Callback = std::function<void(const cuboid_mapping::ChangeSet& changes)>;

  /// @param nh  Namespace of the server's name, and of remappings of the topics.
  /// @param server  Name of the node, in the namespace of nh unless it begins with /. The topics are beside it. The
  ///                client follows this node only. With the default name it also follows the first that it hears
  ///                there, until the named one publishes.
  /// @param callback  May be empty.
  explicit CuboidMapClient(const ros::NodeHandle& nh = ros::NodeHandle(),
                           const std::string& server = "cuboid_mapping", Callback callback = {});
  ~CuboidMapClient();
  CuboidMapClient(const CuboidMapClient&) = delete;
  CuboidMapClient& operator=(const CuboidMapClient&) = delete;

  /// Whether a map has come that knows a voxel. False again while a restarted or reset node's map is empty: no answer
  /// about it helps a planner.
  [[nodiscard]] bool hasMap() const;
  /// Waits until hasMap(). If no map comes for some seconds, and at the timeout, logs whether the topic has a
  /// publisher. Do not call it from the callback.
  /// @return hasMap(); false after the timeout, or when ROS shuts down.
  [[nodiscard]] bool waitForMap(const ros::WallDuration& timeout) const;

  /// The current revision of the map.
  [[nodiscard]] ClientMap current() const;
  /// Reads the map, which does not change meanwhile; it is empty before the first.
  /// @param work  (const CuboidMap&) or (const ClientMap&) -> any; a generic one gets the map.
  template <typename WorkT>
  auto read(const WorkT& work) const {
    const ClientMap now = current();
    if constexpr (std::is_invocable_v<const WorkT&, const cuboid_mapping::CuboidMap&>) {
      return work(now.map());
    } else {
      return work(now);
    }
  }
  /// A map of its own, to be changed at will. To keep a revision, current() is cheaper. @complexity O(n log n).
  [[nodiscard]] cuboid_mapping::CuboidMap copy() const;

  /// Those of current(), which the next call may see changed: within one reader, ask its ClientMap.
  ///@{
  [[nodiscard]] std::uint64_t revision() const { return current().revision(); }
  [[nodiscard]] std::uint64_t instance() const { return current().instance(); }
  [[nodiscard]] std::uint64_t replacements() const { return current().replacements(); }
  [[nodiscard]] ros::Time stamp() const { return current().stamp(); }
  [[nodiscard]] std::string frameId() const { return current().frameId(); }
  ///@}

 private:
  struct Implementation;

  std::unique_ptr<Implementation> implementation_;
};

}  // namespace cuboid_mapping_ros
