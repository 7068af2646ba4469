// SPDX-License-Identifier: BSD-3-Clause
// The messages of octomap_msgs: the package's own if it is installed, else types that are the
// same on the wire, with the same names and checksums.
#pragma once

#if CUBOID_MAPPING_HAS_OCTOMAP_MSGS

#include <octomap_msgs/BoundingBoxQuery.h>
#include <octomap_msgs/GetOctomap.h>
#include <octomap_msgs/Octomap.h>

namespace cuboid_mapping_ros {

using OctomapMessage = octomap_msgs::Octomap;
using GetOctomap = octomap_msgs::GetOctomap;
using BoundingBoxQuery = octomap_msgs::BoundingBoxQuery;

}  // namespace cuboid_mapping_ros

#else

#include <geometry_msgs/Point.h>
#include <ros/message_traits.h>
#include <ros/serialization.h>
#include <ros/service_traits.h>
#include <std_msgs/Header.h>

#include <cstdint>
#include <string>
#include <type_traits>
#include <vector>

namespace cuboid_mapping_ros {

/// octomap_msgs/Octomap: a serialized octree.
struct OctomapMessage {
  std_msgs::Header header;
  std::uint8_t binary = 0;        ///< 1: classes (.bt), 0: log-odds (.ot).
  std::string id;                 ///< Type of the tree: "OcTree".
  double resolution = 0.0;        ///< Metres.
  std::vector<std::int8_t> data;  ///< The nodes.

  using ConstPtr = boost::shared_ptr<const OctomapMessage>;
};

/// octomap_msgs/GetOctomap: asks for an octree.
struct GetOctomap {
  struct Request {};
  struct Response {
    OctomapMessage map;
  };
  // NOLINTNEXTLINE(readability-identifier-naming): roscpp asks for this name
  using RequestType = Request;
  // NOLINTNEXTLINE(readability-identifier-naming)
  using ResponseType = Response;
  Request request;
  Response response;
};

/// octomap_msgs/BoundingBoxQuery: names a box.
struct BoundingBoxQuery {
  struct Request {
    geometry_msgs::Point min;
    geometry_msgs::Point max;
  };
  struct Response {};
  using RequestType = Request;
  using ResponseType = Response;
  Request request;
  Response response;
};

namespace wire {

/// Name of a type on the wire; the checksums are genmsg's.
template <typename T>
struct Name;
template <>
struct Name<OctomapMessage> {
  static constexpr char kType[] = "octomap_msgs/Octomap";
  static constexpr char kMd5[] = "9a45536b45c5e409cd49f04bb2d9999f";
};
template <>
struct Name<GetOctomap> {
  static constexpr char kType[] = "octomap_msgs/GetOctomap";
  static constexpr char kMd5[] = "be9d2869d24fe40d6bc21ac21f6bb2c5";
};
template <>
struct Name<GetOctomap::Request> : Name<GetOctomap> {
  static constexpr char kType[] = "octomap_msgs/GetOctomapRequest";
};
template <>
struct Name<GetOctomap::Response> : Name<GetOctomap> {
  static constexpr char kType[] = "octomap_msgs/GetOctomapResponse";
};
template <>
struct Name<BoundingBoxQuery> {
  static constexpr char kType[] = "octomap_msgs/BoundingBoxQuery";
  static constexpr char kMd5[] = "93aa3d73b866f04880927745f4aab303";
};
template <>
struct Name<BoundingBoxQuery::Request> : Name<BoundingBoxQuery> {
  static constexpr char kType[] = "octomap_msgs/BoundingBoxQueryRequest";
};
template <>
struct Name<BoundingBoxQuery::Response> : Name<BoundingBoxQuery> {
  static constexpr char kType[] = "octomap_msgs/BoundingBoxQueryResponse";
};

/// Traits that roscpp asks a message for.
template <typename T>
struct Md5Trait {
  static const char* value() { return Name<T>::kMd5; }
  static const char* value(const T& /*message*/) { return value(); }
};
template <typename T>
struct TypeTrait {
  static const char* value() { return Name<T>::kType; }
  static const char* value(const T& /*message*/) { return value(); }
};

}  // namespace wire
}  // namespace cuboid_mapping_ros

namespace ros {
namespace message_traits {

template <>
struct IsMessage<cuboid_mapping_ros::OctomapMessage> : TrueType {};
template <>
struct HasHeader<cuboid_mapping_ros::OctomapMessage> : TrueType {};
template <>
struct MD5Sum<cuboid_mapping_ros::OctomapMessage>
    : cuboid_mapping_ros::wire::Md5Trait<cuboid_mapping_ros::OctomapMessage> {};
template <>
struct DataType<cuboid_mapping_ros::OctomapMessage>
    : cuboid_mapping_ros::wire::TypeTrait<cuboid_mapping_ros::OctomapMessage> {};
template <>
struct Definition<cuboid_mapping_ros::OctomapMessage> {
  static const char* value() {
    static const std::string kText =
        "Header header\nbool binary\nstring id\nfloat64 resolution\nint8[] data\n\n"
        "===============================================================================\n"
        "MSG: std_msgs/Header\n" +
        std::string(Definition<std_msgs::Header>::value());
    return kText.c_str();
  }
  static const char* value(const cuboid_mapping_ros::OctomapMessage& /*message*/) {
    return value();
  }
};

#define CUBOID_MAPPING_NAME_ON_THE_WIRE(Type)                        \
  template <>                                                        \
  struct MD5Sum<Type> : cuboid_mapping_ros::wire::Md5Trait<Type> {}; \
  template <>                                                        \
  struct DataType<Type> : cuboid_mapping_ros::wire::TypeTrait<Type> {};
CUBOID_MAPPING_NAME_ON_THE_WIRE(cuboid_mapping_ros::GetOctomap::Request)
CUBOID_MAPPING_NAME_ON_THE_WIRE(cuboid_mapping_ros::GetOctomap::Response)
CUBOID_MAPPING_NAME_ON_THE_WIRE(cuboid_mapping_ros::BoundingBoxQuery::Request)
CUBOID_MAPPING_NAME_ON_THE_WIRE(cuboid_mapping_ros::BoundingBoxQuery::Response)
#undef CUBOID_MAPPING_NAME_ON_THE_WIRE

}  // namespace message_traits

namespace service_traits {

#define CUBOID_MAPPING_NAME_OF_SERVICE(Type, Service)                                     \
  template <>                                                                             \
  struct MD5Sum<Type> : cuboid_mapping_ros::wire::Md5Trait<Type> {};                      \
  template <>                                                                             \
  struct DataType<Type> {                                                                 \
    static const char* value() { return cuboid_mapping_ros::wire::Name<Service>::kType; } \
    static const char* value(const Type& /*message*/) { return value(); }                 \
  };
CUBOID_MAPPING_NAME_OF_SERVICE(cuboid_mapping_ros::GetOctomap, cuboid_mapping_ros::GetOctomap)
CUBOID_MAPPING_NAME_OF_SERVICE(cuboid_mapping_ros::GetOctomap::Request,
                               cuboid_mapping_ros::GetOctomap)
CUBOID_MAPPING_NAME_OF_SERVICE(cuboid_mapping_ros::GetOctomap::Response,
                               cuboid_mapping_ros::GetOctomap)
CUBOID_MAPPING_NAME_OF_SERVICE(cuboid_mapping_ros::BoundingBoxQuery,
                               cuboid_mapping_ros::BoundingBoxQuery)
CUBOID_MAPPING_NAME_OF_SERVICE(cuboid_mapping_ros::BoundingBoxQuery::Request,
                               cuboid_mapping_ros::BoundingBoxQuery)
CUBOID_MAPPING_NAME_OF_SERVICE(cuboid_mapping_ros::BoundingBoxQuery::Response,
                               cuboid_mapping_ros::BoundingBoxQuery)
#undef CUBOID_MAPPING_NAME_OF_SERVICE

}  // namespace service_traits

namespace serialization {

template <>
struct Serializer<cuboid_mapping_ros::OctomapMessage> {
  template <typename StreamT, typename MessageT>
  static void allInOne(StreamT& stream, MessageT message) {
    stream.next(message.header);
    stream.next(message.binary);
    stream.next(message.id);
    stream.next(message.resolution);
    stream.next(message.data);
  }
  ROS_DECLARE_ALLINONE_SERIALIZER
};

template <>
struct Serializer<cuboid_mapping_ros::GetOctomap::Request> {
  template <typename StreamT, typename MessageT>
  static void allInOne(StreamT& /*stream*/, MessageT /*message*/) {}
  ROS_DECLARE_ALLINONE_SERIALIZER
};

template <>
struct Serializer<cuboid_mapping_ros::GetOctomap::Response> {
  template <typename StreamT, typename MessageT>
  static void allInOne(StreamT& stream, MessageT message) {
    stream.next(message.map);
  }
  ROS_DECLARE_ALLINONE_SERIALIZER
};

template <>
struct Serializer<cuboid_mapping_ros::BoundingBoxQuery::Request> {
  template <typename StreamT, typename MessageT>
  static void allInOne(StreamT& stream, MessageT message) {
    stream.next(message.min);
    stream.next(message.max);
  }
  ROS_DECLARE_ALLINONE_SERIALIZER
};

template <>
struct Serializer<cuboid_mapping_ros::BoundingBoxQuery::Response> {
  template <typename StreamT, typename MessageT>
  static void allInOne(StreamT& /*stream*/, MessageT /*message*/) {}
  ROS_DECLARE_ALLINONE_SERIALIZER
};

}  // namespace serialization
}  // namespace ros

#endif  // CUBOID_MAPPING_HAS_OCTOMAP_MSGS
