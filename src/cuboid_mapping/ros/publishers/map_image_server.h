// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/FullCuboidMap.h"
#include "cuboid_mapping/GetMap.h"
#include "cuboid_mapping/ros/conversions/map_messages.h"

#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <ros/service_server.h>
#include <ros/time.h>

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {

/// The topic cuboid_map and the service ~get_map: whole maps, in parts that fit into messages.
///
/// The topic carries the first part of a map; listeners ask the service for the others, so that no queue
/// grows by more than a message. What they ask for is kept meanwhile: kKept maps of several parts at most,
/// each until nobody has asked for kKeptFor_s.
/// Thread rule: all calls, and the callbacks of the node handles' queue, one after the other.
class MapImageServer {
 public:
  using Make = std::function<ImageMessage(cuboid_mapping::MapDetail)>;
  using Note = std::function<std::string()>;

  static constexpr std::size_t kKept = 2;
  static constexpr double kKeptFor_s = 60.0;

  struct Options {
    cuboid_mapping::MapDetail topic_detail = cuboid_mapping::MapDetail::kClasses;
    std::size_t max_part_bytes = 250000000;  ///< Before a part is deflated.
  };

  /// @param nh, private_nh  Of the topic, and of the service. @param make  The whole map as it is now.
  /// @param note  What callers of ~get_map are told of the map, empty for nothing.
  MapImageServer(ros::NodeHandle nh, ros::NodeHandle private_nh, const Options& options, Make make,
                 Note note);
  MapImageServer(const MapImageServer&) = delete;
  MapImageServer& operator=(const MapImageServer&) = delete;

  [[nodiscard]] std::uint32_t numListeners() const { return publisher_.getNumSubscribers(); }
  /// Sends the map to all listeners.
  void publish();
  /// To be called now and then: lets go what nobody asks for any more.
  void forgetOld();

 private:
  using Message = cuboid_mapping::FullCuboidMap;
  struct Kept {
    cuboid_mapping::MapDetail detail;
    std::vector<Message> parts;
    ros::WallTime used;
  };

  [[nodiscard]] Message makeFirst(cuboid_mapping::MapDetail detail);
  [[nodiscard]] std::vector<Message> makeParts(const ImageMessage& whole) const;
  void answer(const cuboid_mapping::GetMap::Request& request,
              cuboid_mapping::GetMap::Response& response);
  /// nullptr when it is not kept.
  Kept* find(cuboid_mapping::MapDetail detail, std::uint64_t revision);

  Options options_;
  Make make_;
  Note note_;
  std::deque<Kept> kept_;  ///< The newest last.
  ros::Publisher publisher_;
  ros::ServiceServer server_;
};

}  // namespace cuboid_mapping_ros
