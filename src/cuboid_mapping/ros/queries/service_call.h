// SPDX-License-Identifier: BSD-3-Clause
// Common parts of all services that read the map.
#pragma once

#include "cuboid_mapping/AnswerInfo.h"
#include "cuboid_mapping/Box.h"
#include "cuboid_mapping/MapCuboid.h"
#include "cuboid_mapping/map/cuboid_search.h"
#include "cuboid_mapping/query/budget.h"
#include "cuboid_mapping/query/pose_query.h"
#include "cuboid_mapping/query/unknown_policy.h"
#include "cuboid_mapping/ros/conversions/points.h"
#include "cuboid_mapping/ros/map/guarded_map.h"
#include "cuboid_mapping/ros/parameters/parameters.h"

#include <geometry_msgs/Pose.h>
#include <geometry_msgs/Transform.h>
#include <std_msgs/Header.h>
#include <tf2/buffer_core.h>

#include <Eigen/Geometry>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {

/// Reason of a refused request, and the cure.
class Refusal : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Kind of the entries of a request.
struct Entries {
  const char* name;          ///< Name such as "boxes".
  std::size_t answer_bytes;  ///< Answer bytes of each entry.
};

/// Name of a field of a request, or of one of its elements: "size", "origins[3]".
struct FieldName {
  const char* name;
  std::optional<std::size_t> element = std::nullopt;
};

/// A map with its frame and limits, for services.
struct MapInFrame {
  GuardedMap& map;                                ///< The map and its lock.
  std::string frame_id;                           ///< Frame of the map.
  const tf2::BufferCore& tf;                      ///< Transforms for requests in other frames.
  ServiceLimits limits = {};                      ///< Limits of each call.
  const std::atomic<bool>* is_stopped = nullptr;  ///< Set to end all calls.
};

/// A service call: reads the request, and accesses the map within the limits.
///
/// Reading functions check a value and transform it to the frame of the map. They throw a Refusal, whose text
/// names the field and says what to do. While the call lives, no page of the map is evicted.
class ServiceCall {
 public:
  /// Looks up the frame of the request. If its stamp is ahead of tf, waits for at most 0.2 s of wall time.
  ServiceCall(const MapInFrame& map, const std_msgs::Header& header);

  /// Edge of a voxel [m].
  [[nodiscard]] double resolution() const { return map_.map.grid().resolution(); }
  [[nodiscard]] GuardedMap& map() const { return map_.map; }

  // Functions that read the request.

  /// Refuses a request with more entries than the limits allow.
  void requireFew(std::size_t num_entries, const Entries& entries) const;
  /// A finite point.
  [[nodiscard]] Eigen::Vector3d point(const geometry_msgs::Point& point,
                                      const FieldName& field) const;
  /// A finite pose, in the frame of the request. Its quaternion has length 1 within 1 %; all zeros mean no
  /// rotation.
  [[nodiscard]] static Eigen::Isometry3d localPose(const geometry_msgs::Pose& pose,
                                                   const FieldName& field);
  /// As above, transformed to the frame of the map.
  [[nodiscard]] Eigen::Isometry3d pose(const geometry_msgs::Pose& pose,
                                       const FieldName& field) const {
    return to_map_ * localPose(pose, field);
  }
  /// Finite points, within the limits.
  [[nodiscard]] std::vector<Eigen::Vector3d> points(const std::vector<geometry_msgs::Point>& points,
                                                    const Entries& entries) const;
  /// A finite direction that is not zero, scaled to length 1.
  [[nodiscard]] Eigen::Vector3d direction(const geometry_msgs::Vector3& direction,
                                          const FieldName& field) const;
  /// Edges, finite and > 0, in the frame of the request.
  [[nodiscard]] static Eigen::Vector3d edges(const geometry_msgs::Vector3& size,
                                             const char* name = "size");
  /// Edges, > 0, of the smallest box along the map's axes that contains a box with these edges, with inflation on
  /// all sides of the enclosing box.
  [[nodiscard]] Eigen::Vector3d size(const geometry_msgs::Vector3& size, double inflation_m,
                                     const char* name = "size");
  /// A box with min < max, inflated, as the voxels that it overlaps.
  [[nodiscard]] CellBox box(const Box& box, double inflation_m, const FieldName& field);
  /// Boxes, within the limits.
  [[nodiscard]] std::vector<CellBox> boxes(const std::vector<Box>& boxes, double inflation_m,
                                           const Entries& entries);
  /// A finite number >= 0.
  [[nodiscard]] static double notNegative(double value, const char* name);
  /// A finite number > 0.
  [[nodiscard]] static double positive(double value, const char* name);
  [[nodiscard]] static UnknownPolicy policy(std::uint8_t unknown);
  /// FREE, OCCUPIED or ALL, which have the same values in all requests.
  [[nodiscard]] static CuboidFilter classes(std::uint8_t classes);

  /// The voxels that a box in metres overlaps, map frame; see requireLoaded().
  CellBox requireCells(const MetricBox& box_map);
  /// Refuses a request about cells that are on disk only, or loads them, depending on the limits.
  void requireLoaded(const CellBox& box);

  // Functions that answer.

  /// Status of the answer.
  [[nodiscard]] AnswerInfo& info() { return info_; }

  /// Reads the map, taking turns with others.
  /// @param work  (const CuboidMap&, Budget&). @param max_time_s  Limit of the request; the node's holds, too.
  template <typename WorkT>
  void read(std::size_t entry_bytes, const WorkT& work,
            double max_time_s = std::numeric_limits<double>::infinity()) {
    time_limit_s_ = max_time_s;
    map_.map.readInTurns(limits(entry_bytes, max_time_s), map_.is_stopped,
                         [&](const CuboidMap& content, const ros::Time& stamp, Budget& budget) {
                           fillInfo(content, stamp);
                           work(content, budget);
                         });
  }

  /// Answers the entries of a request, one after the other, within the limits. The answers of remaining entries
  /// stay as they are.
  /// @param answer  (const CuboidMap&, std::size_t entry, Budget&): fills in the answer, unless the budget is
  ///                spent.
  template <typename AnswerT>
  void readEach(const Entries& entries, std::size_t num_entries, const AnswerT& answer) {
    read(entries.answer_bytes, [&](const CuboidMap& content, Budget& budget) {
      doEach(entries, num_entries, budget, [&](std::size_t i) { answer(content, i, budget); });
    });
  }

  /// As readEach(), for changes. @param change  (std::size_t entry, Budget&).
  template <typename ChangeT>
  void changeEach(const Entries& entries, std::size_t num_entries, const ChangeT& change) {
    Budget budget(editLimits(), {{}, std::numeric_limits<double>::infinity(), map_.is_stopped});
    doEach(entries, num_entries, budget, [&](std::size_t i) { change(i, budget); });
    map_.map.read(
        [this](const CuboidMap& content, const ros::Time& stamp) { fillInfo(content, stamp); });
  }

  /// Notes in the answer that it was cut short if the budget is spent. @param advice  What to do.
  void noteEnd(const Budget& budget, const std::string& advice);

 private:
  [[nodiscard]] QueryLimits limits(std::size_t entry_bytes, double max_time_s) const;
  [[nodiscard]] QueryLimits editLimits() const;
  void fillInfo(const CuboidMap& content, const ros::Time& stamp);
  void noteAnswered(const Entries& entries, std::size_t num_answered, std::size_t num_entries,
                    const Budget& budget);

  template <typename WorkT>
  void doEach(const Entries& entries, std::size_t num_entries, Budget& budget, const WorkT& work) {
    std::size_t num_answered = 0;
    for (; num_answered < num_entries && budget.checkClock(); ++num_answered) {
      work(num_answered);
      if (budget.isSpent()) break;
    }
    noteAnswered(entries, num_answered, num_entries, budget);
  }

  const MapInFrame& map_;
  PageHold hold_;              ///< Keeps pages in memory until the end.
  std::size_t num_pages_ = 0;  ///< Number of pages loaded for the request.
  Eigen::Isometry3d to_map_ = Eigen::Isometry3d::Identity();       ///< From the request's frame.
  double time_limit_s_ = std::numeric_limits<double>::infinity();  ///< Of the request.
  bool is_turned_ = false;  ///< The request's frame, by other than multiples of 90 degrees.
  AnswerInfo info_;
};

/// Loads the parts of a box that are on disk only, if the limits allow it.
/// @param num_pages  Pages of the call, to which those of the box are added.
/// @return Reason and cure if they are not loaded; else empty.
[[nodiscard]] std::string loadPages(const MapInFrame& map, const CellBox& box,
                                    std::size_t& num_pages);

/// The transform of a request. A quaternion with few digits is scaled to length 1; all zeros mean no rotation;
/// others stay invalid, for other functions to refuse.
[[nodiscard]] Eigen::Isometry3d toIsometry(geometry_msgs::Transform transform);

/// Status of an answer, with the map's stamp, frame and revision; `error` is empty, or the reason of refusal.
[[nodiscard]] AnswerInfo makeInfo(const GuardedMap& map, const std::string& frame_id,
                                  const std::string& error);

/// Box in metres, frame of the map.
[[nodiscard]] Box boxMessage(const Grid& grid, const CellBox& box);
/// Cuboid with the mean probability of its voxels; 0 if the budget is spent.
[[nodiscard]] MapCuboid cuboidMessage(const CuboidMap& map, const Cuboid& cuboid, Budget& budget);

/// A box with its origin in the middle, inflated on all sides. Throws a Refusal.
[[nodiscard]] Body readTurningBox(const ServiceCall& call, const geometry_msgs::Vector3& size,
                                  double inflation_m);

/// A pose in the frame of the map. Throws a Refusal. @param heading_rad  About z of the request's frame.
[[nodiscard]] Eigen::Isometry3d readHeaded(const ServiceCall& call,
                                           const geometry_msgs::Point& point,
                                           const FieldName& field, double heading_rad);

}  // namespace cuboid_mapping_ros
