// SPDX-License-Identifier: BSD-3-Clause
// Conversion of FullCuboidMap, CuboidMapUpdate and the service GetMap to images and changes of maps, and back.
#pragma once

#include "cuboid_mapping/CuboidMapUpdate.h"
#include "cuboid_mapping/FullCuboidMap.h"
#include "cuboid_mapping/GetMap.h"
#include "cuboid_mapping/ros/middleware/core_names.h"
#include "cuboid_mapping/ros/middleware/service_calls.h"
#include "cuboid_mapping/sharing/map_follower.h"

#include <ros/node_handle.h>
#include <ros/publisher.h>

#include <cstdint>
#include <string>

namespace cuboid_mapping_ros {

/// An image of a map.
struct ImageMessage {
  MapImage image;
  /// If more than one: `image` has the bricks of `part` only, or of all up to it after appendPart().
  std::uint32_t num_parts = 1;
  std::uint32_t part = 0;
  std::string server;  ///< Namespace of the services of the node.
};
/// Changes of a map.
struct DeltaMessage {
  MapDelta delta;
  std::string server;
};

/// The message of an image, or of some of its bricks.
///@{
[[nodiscard]] FullCuboidMap toMessage(const ImageMessage& from);
[[nodiscard]] FullCuboidMap toMessage(const ImageMessage& from, const VoxelBrick* first,
                                      const VoxelBrick* last);
///@}
[[nodiscard]] CuboidMapUpdate toMessage(const DeltaMessage& from);

/// The image in a message. A damaged image has resolution 0, which followers refuse.
[[nodiscard]] ImageMessage fromMessage(const FullCuboidMap& message);
/// The changes in a message. A damaged message counts as a change of everything.
[[nodiscard]] DeltaMessage fromMessage(const CuboidMapUpdate& message);

/// Calls the service GetMap. A call lasts as long as the transfer takes. Thread-safe.
class GetMapClient {
 public:
  /// @param nh  Namespace of the services.
  explicit GetMapClient(const ros::NodeHandle& nh) : nh_(nh) {}

  /// Asks for all parts of the map. @param error  Reason if there is none.
  /// @return false without an answer, or if the answer has no map.
  [[nodiscard]] bool call(const std::string& name, MapDetail detail, ImageMessage& message,
                          std::string& error);
  /// Asks for the parts after `part`, the last one in the image. @return As call().
  [[nodiscard]] bool callForRest(const std::string& name, ImageMessage& message,
                                 std::string& error);
  /// Ends the waiting call, and refuses others.
  void stop() { calls_.stop(); }

 private:
  [[nodiscard]] bool callForPart(const std::string& name, GetMap& service, std::string& error);

  ros::NodeHandle nh_;
  ServiceCalls calls_;
};

/// Appends the next part to an image. @return false if it is another part.
[[nodiscard]] bool appendPart(const ImageMessage& part, ImageMessage& message);

}  // namespace cuboid_mapping_ros
