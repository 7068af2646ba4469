// SPDX-License-Identifier: BSD-3-Clause
// Requests with arbitrary numbers to all services that answer from the map.
#include "cuboid_mapping/ros/edits/map_edits.h"
#include "cuboid_mapping/ros/map/guarded_map.h"
#include "cuboid_mapping/ros/planning/planner_services.h"

#include "fuzz_input.h"
#include "fuzz_target.h"

#include <geometry_msgs/TransformStamped.h>

#include <cstdlib>

namespace {

using namespace cuboid_mapping;
using namespace cuboid_mapping_ros;

/// A room with a wall and a door, as in the tests of the answers.
class Room {
 public:
  Room() : map_(makeConfig()) {
    map_.change(ros::Time(7.0), [](CuboidMap& map) {
      return map.replace(kAllCells, {{{{0, 0, 0}, {10, 10, 10}}, -1.0F},
                                     {{{11, 0, 0}, {20, 10, 10}}, -1.0F},
                                     {{{10, 0, 0}, {11, 3, 10}}, 1.0F},
                                     {{{10, 3, 0}, {11, 6, 10}}, -2.0F}});
    });
    geometry_msgs::TransformStamped transform;
    transform.header.frame_id = "map";
    transform.child_frame_id = "turned";
    transform.transform.translation.x = 5.0;
    transform.transform.rotation.z = transform.transform.rotation.w = 0.70710678118654757;
    tf_.setTransform(transform, "fuzz", true);
  }
  [[nodiscard]] const MapInFrame& inFrame() const { return in_frame_; }

 private:
  static MapConfig makeConfig() {
    MapConfig config;
    config.resolution_m = 0.1;
    return config;
  }
  GuardedMap map_;
  tf2::BufferCore tf_;
  MapInFrame in_frame_{map_, "map", tf_};
};

/// Takes the fields of requests from the input.
class Taker {
 public:
  explicit Taker(FuzzInput& input) : input_(input) {}

  void operator()(std_msgs::Header& header) {
    const char* frames[] = {"", "", "map", "turned", "nowhere"};
    header.frame_id = frames[input_.upTo(4)];
    if (input_.upTo(7) == 0) header.stamp.sec = input_.take<std::uint32_t>();
  }
  void operator()(geometry_msgs::Point& point) { takeXyz(point); }
  void operator()(geometry_msgs::Vector3& vector) { takeXyz(vector); }
  void operator()(geometry_msgs::Pose& pose) {
    (*this)(pose.position);
    pose.orientation.w = input_.upTo(7) == 0 ? input_.number() : 1.0;
  }
  void operator()(Box& box) { (*this)(box.min, box.max); }
  void operator()(double& number) { number = input_.number(); }
  void operator()(std::uint8_t& number) {
    number = input_.upTo(7) == 0 ? input_.take<std::uint8_t>()
                                 : static_cast<std::uint8_t>(input_.upTo(3));
  }
  void operator()(std::uint32_t& number) {
    number = input_.upTo(7) == 0 ? input_.take<std::uint32_t>()
                                 : static_cast<std::uint32_t>(input_.upTo(5));
  }
  void operator()(float& number) { number = static_cast<float>(input_.number()); }
  template <typename T>
  void operator()(std::vector<T>& items) {
    items.resize(input_.upTo(4));
    for (T& item : items) (*this)(item);
  }
  template <typename FirstT, typename SecondT, typename... RestT>
  void operator()(FirstT& first, SecondT& second, RestT&... rest) {
    (*this)(first);
    (*this)(second, rest...);
  }

 private:
  template <typename T>
  void takeXyz(T& xyz) {
    xyz.x = input_.number();
    xyz.y = input_.number();
    xyz.z = input_.number();
  }
  FuzzInput& input_;
};

template <typename ResponseT>
bool isAnswer(const ResponseT& response) {
  return response.info.success != 0 || !response.info.message.empty();
}
bool isAnswer(const QueryBox::Response& response) {
  return response.success != 0 || !response.message.empty();
}

/// Calls a service, which must answer, or refuse with a reason.
/// @param fill  (Taker&, RequestT&): sets the fields of the request.
template <typename ServiceT, typename FillT>
void ask(const MapInFrame& map, FuzzInput& input, const FillT& fill) {
  typename ServiceT::Request request;
  Taker take(input);
  fill(take, request);
  if (!isAnswer(answer<ServiceT>(map, request))) std::abort();
}

void askOne(const MapInFrame& map, FuzzInput& input) {
  switch (input.upTo(12)) {
    case 0:
      return ask<CheckBoxes>(map, input, [](Taker& take, auto& r) {
        take(r.header, r.boxes, r.inflation, r.unknown);
      });
    case 1:
      return ask<CheckPath>(map, input, [](Taker& take, auto& r) {
        take(r.header, r.waypoints, r.lengths, r.size, r.inflation, r.unknown, r.headings);
      });
    case 2:
      return ask<CastRays>(map, input, [](Taker& take, auto& r) {
        take(r.header, r.origins, r.directions, r.max_range, r.inflation, r.unknown);
      });
    case 3:
      return ask<FindNearest>(map, input, [](Taker& take, auto& r) {
        take(r.header, r.points, r.classes, r.k, r.max_distance, r.inflation);
      });
    case 4:
      return ask<FindNearestFree>(map, input, [](Taker& take, auto& r) {
        take(r.header, r.points, r.size, r.inflation, r.unknown, r.max_distance);
      });
    case 5:
      return ask<GetCuboids>(map, input, [](Taker& take, auto& r) {
        take(r.header, r.everything, r.region, r.inflation, r.classes);
        take(r.min_edge, r.clip, r.joined, r.limit);
      });
    case 6:
      return ask<GetFreeGraph>(map, input, [](Taker& take, auto& r) {
        take(r.header, r.region, r.size, r.inflation, r.limit);
      });
    case 7:
      return ask<FindCorridor>(map, input, [](Taker& take, auto& r) {
        take(r.header, r.start, r.goal, r.size, r.inflation, r.unknown, r.time_limit, r.use_region);
        take(r.region, r.headings, r.climb);
      });
    case 8:
      return ask<SetBox>(map, input, [](Taker& take, auto& r) {
        take(r.header, r.boxes, r.inflation, r.occupancy, r.probability, r.lock);
      });
    case 9:
      return ask<CheckPoses>(map, input, [](Taker& take, auto& r) {
        take(r.header, r.poses, r.spheres, r.radii, r.boxes, r.sizes, r.inflation, r.unknown);
      });
    case 10:
      return ask<GetDistances>(map, input, [](Taker& take, auto& r) {
        take(r.header, r.points, r.max_distance, r.unknown);
      });
    case 11:
      return ask<GetFrontiers>(map, input, [](Taker& take, auto& r) {
        take(r.header, r.everything, r.region, r.min_voxels, r.size, r.inflation, r.max_distance);
        take(r.view_range, r.with_voxels);
      });
    default:
      return ask<QueryBox>(map, input, [](Taker& take, QueryBox::Request& r) {
        take(r.header, r.min, r.max, r.cuboids, r.clip);
      });
  }
}

}  // namespace

FUZZ_TARGET(fuzz_requests) {
  FuzzInput input(data, size);
  const Room room;
  for (int i = 0; i < 4 && !input.isEmpty(); ++i) askOne(room.inFrame(), input);
  return 0;
}
