// SPDX-License-Identifier: BSD-3-Clause
// What the answers to planners have in common.
#pragma once

#include "cuboid_mapping/query/unknown_policy.h"
#include "cuboid_mapping/ros/conversions/points.h"
#include "cuboid_mapping/ros/map/guarded_map.h"
#include "cuboid_mapping/ros/middleware/tf_lookup.h"
#include "cuboid_mapping/ros/services/map_in_frame.h"

#include <geometry_msgs/Transform.h>
#include <std_msgs/Header.h>

#include <Eigen/Geometry>

#include <cstddef>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

namespace cuboid_mapping_ros {

/// A field of a request, or one of its elements: "size", "origins[3]".
struct FieldName {
  std::string name;
  std::optional<std::size_t> element = std::nullopt;
};

/// Reads a request: checks its values and takes them to the frame of the map.
///
/// After the first fault the values that are returned mean nothing; error() says what is wrong and
/// what to do. Names are those of the fields, for that text.
class RequestReader {
 public:
  /// Looks up the frame of the request; does not wait for tf.
  RequestReader(const MapInFrame& map, const std_msgs::Header& header);

  /// Empty: nothing is wrong so far.
  [[nodiscard]] const std::string& error() const { return error_; }
  [[nodiscard]] bool isGood() const { return error_.empty(); }

  /// Says what is wrong unless the condition holds.
  void require(bool condition, const std::string& text);
  /// The same for checks of each entry: making the text would take longer than the check.
  template <typename MakeTextT, typename = std::enable_if_t<std::is_invocable_v<MakeTextT>>>
  void require(bool condition, const MakeTextT& make_text) {
    if (!condition && error_.empty()) error_ = make_text();
  }

  /// Refuses a request with more entries than the limits allow. @param name  Of them, as "boxes".
  /// @param entry_bytes  Of the answer to each.
  void requireFew(std::size_t num_entries, const std::string& name, std::size_t entry_bytes);

  /// A finite point.
  Eigen::Vector3d point(const geometry_msgs::Point& point, const FieldName& field);
  std::vector<Eigen::Vector3d> points(const std::vector<geometry_msgs::Point>& points,
                                      const std::string& name);
  /// A finite direction that is not zero.
  Eigen::Vector3d direction(const geometry_msgs::Vector3& direction, const FieldName& field);
  /// Edges, > 0, of the smallest box of the map's axes that covers one of these edges, and
  /// inflation on all sides.
  Eigen::Vector3d size(const geometry_msgs::Vector3& size, double inflation_m);
  /// A box with min < max, inflated, as the voxels that it overlaps.
  cuboid_mapping::CellBox box(const geometry_msgs::Point& min, const geometry_msgs::Point& max,
                              double inflation_m);
  std::vector<cuboid_mapping::CellBox> boxes(const std::vector<geometry_msgs::Point>& min,
                                             const std::vector<geometry_msgs::Point>& max,
                                             double inflation_m);
  /// The voxels that a box in metres overlaps, map frame; see requireLoaded().
  cuboid_mapping::CellBox cells(const cuboid_mapping::MetricBox& box_map);
  /// Refuses a request about cells that are on disk only, or brings them back, as the limits say.
  void requireLoaded(const cuboid_mapping::CellBox& box);
  /// A finite number >= 0.
  double notNegative(double value, const std::string& name);
  cuboid_mapping::UnknownPolicy policy(std::uint8_t unknown);

 private:
  const MapInFrame& map_;
  PageHold hold_;              ///< So that what was there at the beginning is there at the end.
  std::size_t num_pages_ = 0;  ///< That were brought back for the request.
  Eigen::Isometry3d to_map_ = Eigen::Isometry3d::Identity();  ///< From the request's frame.
  std::string error_;
};

/// Brings the parts of a box back that are on disk only, if the limits allow it.
/// @param num_pages  Of the call: those of the box are added.
/// @return Why they are not there, and what to do; empty: they are.
[[nodiscard]] std::string loadPages(GuardedMap& map, const cuboid_mapping::CellBox& box,
                                    const ServiceLimits& limits, std::size_t& num_pages);

/// The transform of a request. A quaternion of few digits is made one of length 1; all zeros are no turn; others stay what
/// they are, for others to refuse.
[[nodiscard]] Eigen::Isometry3d toIsometry(geometry_msgs::Transform transform);

/// An answer that says why there is none.
template <typename ResponseT>
[[nodiscard]] ResponseT refuse(const std::string& message) {
  ResponseT response;
  response.success = static_cast<std::uint8_t>(false);
  response.message = message;
  return response;
}

/// Fills what every answer says of the map that it is from.
template <typename ResponseT>
void fillHead(const MapInFrame& map, const cuboid_mapping::CuboidMap& content,
              const ros::Time& stamp, ResponseT& response) {
  response.success = static_cast<std::uint8_t>(true);
  response.header.frame_id = withoutSlash(map.frame_id);
  response.header.stamp = stamp;
  response.revision = content.revision();
}

}  // namespace cuboid_mapping_ros
