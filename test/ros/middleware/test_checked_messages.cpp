// SPDX-License-Identifier: BSD-3-Clause
// Bytes that claim to be a message: arrays of any length, and what is there of them.
#include "cuboid_mapping/ros/middleware/checked_messages.h"

#include "cuboid_mapping/CheckPath.h"

#include <gtest/gtest.h>
#include <sensor_msgs/PointCloud2.h>
#include <std_srvs/Trigger.h>
#include <tf2_msgs/TFMessage.h>

#include <cstring>
#include <stdexcept>

namespace cuboid_mapping_ros {
namespace {

namespace ser = ros::serialization;
using cuboid_mapping::CheckPath;
using ser::StreamOverrunException;

template <typename MessageT>
std::vector<std::uint8_t> toBytes(const MessageT& message) {
  std::vector<std::uint8_t> bytes(ser::serializationLength(message));
  ser::OStream stream(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
  ser::serialize(stream, message);
  return bytes;
}

template <typename MessageT>
void read(std::vector<std::uint8_t> bytes, MessageT& message) {
  readChecked(bytes.data(), bytes.size(), message);
}

void claim(std::vector<std::uint8_t>& bytes, std::size_t at, std::uint32_t count) {
  ASSERT_LE(at + sizeof(count), bytes.size());
  std::memcpy(&bytes[at], &count, sizeof(count));
}

CheckPath::Request makeRequest() {
  CheckPath::Request request;
  request.header.frame_id = "map";
  request.waypoints.resize(3);
  request.waypoints[2].y = 7.0;
  request.lengths = {1, 2};
  return request;
}

constexpr std::size_t kWaypoints = 4 + 8 + 4 + 3;  ///< Where their number is: after the header.
constexpr std::size_t kLengths = kWaypoints + 4 + 3 * 24;

TEST(CheckedMessages, GiveBackWhatWasWritten) {
  CheckPath::Request request;
  read(toBytes(makeRequest()), request);
  EXPECT_EQ(request.header.frame_id, "map");
  ASSERT_EQ(request.waypoints.size(), 3U);
  EXPECT_EQ(request.waypoints[2].y, 7.0);
  EXPECT_EQ(request.lengths, (std::vector<std::uint32_t>{1, 2}));
}

TEST(CheckedMessages, TakeNoMemoryForAnArrayThatIsNotThere) {
  // 0x40000000 elements of 4 bytes are 0 bytes in roscpp's 32 bits: it took 4 GB, and then went on.
  for (const std::uint32_t count : {0xffffff18U, 0x40000000U, 1000U, 31U}) {
    for (const std::size_t at : {kWaypoints, kLengths}) {
      auto bytes = toBytes(makeRequest());
      claim(bytes, at, count);
      CheckPath::Request request;
      EXPECT_THROW(read(bytes, request), StreamOverrunException) << count << " at " << at;
      EXPECT_LE(request.waypoints.capacity(), 3U);
      EXPECT_EQ(request.lengths.capacity(), 0U);
    }
  }
}

TEST(CheckedMessages, RefuseEveryMessageThatIsCutOff) {
  const auto bytes = toBytes(makeRequest());
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    CheckPath::Request request;
    EXPECT_THROW(read({bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size)}, request),
                 StreamOverrunException)
        << size;
  }
}

TEST(CheckedMessages, CountTheBytesOfElementsThatHaveArraysThemselves) {
  tf2_msgs::TFMessage transforms;
  transforms.transforms.resize(2);
  auto bytes = toBytes(transforms);
  tf2_msgs::TFMessage read_back;
  read(bytes, read_back);
  EXPECT_EQ(read_back.transforms.size(), 2U);
  claim(bytes, 0, 3);
  tf2_msgs::TFMessage refused;
  EXPECT_THROW(read(bytes, refused), StreamOverrunException);
  EXPECT_EQ(refused.transforms.capacity(), 0U);
}

/// What a caller is sent: whether there is an answer, and its bytes or the words of an error.
struct Sent {
  bool is_answer = false;
  std::string words;
};

template <typename ServiceT>
Sent call(
    CallbackGuard& guard,
    const std::function<bool(typename ServiceT::Request&, typename ServiceT::Response&)>& answer,
    std::vector<std::uint8_t> bytes) {
  CheckedService<typename ServiceT::Request, typename ServiceT::Response> service(guard, "path",
                                                                                  answer);
  ros::ServiceCallbackHelperCallParams params;
  params.request.buf.reset(new std::uint8_t[bytes.size() + 4]);
  params.request.message_start = params.request.buf.get() + 4;
  params.request.num_bytes = bytes.size() + 4;
  std::copy(bytes.begin(), bytes.end(), params.request.message_start);
  Sent sent;
  sent.is_answer = service.call(params);
  EXPECT_EQ(sent.is_answer, params.response.buf[0] == 1);
  ser::IStream stream(params.response.buf.get() + 1,
                      static_cast<std::uint32_t>(params.response.num_bytes - 1));
  if (!sent.is_answer) ser::deserialize(stream, sent.words);
  EXPECT_EQ(sent.is_answer, stream.getLength() > 0);
  return sent;
}

TEST(CheckedService, RefusesADamagedRequestAndSaysSo) {
  CallbackGuard guard;
  int num_called = 0;
  const auto answer = [&](CheckPath::Request&, CheckPath::Response&) { return ++num_called > 0; };
  EXPECT_TRUE(call<CheckPath>(guard, answer, toBytes(makeRequest())).is_answer);
  EXPECT_EQ(num_called, 1);
  EXPECT_EQ(guard.numRefused(), 0U);
  auto bytes = toBytes(makeRequest());
  claim(bytes, kLengths, 0xffffff18U);
  const Sent sent = call<CheckPath>(guard, answer, bytes);
  EXPECT_FALSE(sent.is_answer);
  EXPECT_EQ(sent.words,
            "the request is damaged: an array claims 4294967064 elements, with 41 bytes left");
  EXPECT_EQ(num_called, 1);
  EXPECT_EQ(guard.numRefused(), 1U);
  EXPECT_EQ(guard.numFailures(), 0U);
}

TEST(CheckedService, SaysWhatAServiceHasThrown) {
  using std_srvs::Trigger;
  CallbackGuard guard;
  const auto fail = [](Trigger::Request&, Trigger::Response&) -> bool {
    throw std::runtime_error("no memory");
  };
  const Sent sent = call<Trigger>(guard, fail, {});
  EXPECT_FALSE(sent.is_answer);
  EXPECT_EQ(sent.words, "no memory");
  EXPECT_EQ(guard.lastFailure(), "path: no memory");
  const auto fail_oddly = [](Trigger::Request&, Trigger::Response&) -> bool { throw 7; };
  EXPECT_FALSE(call<Trigger>(guard, fail_oddly, {}).is_answer);
  EXPECT_EQ(guard.numFailures(), 2U);
}

TEST(CheckedService, SaysWhatItRefusesWhichIsNoFailure) {
  using std_srvs::Trigger;
  CallbackGuard guard;
  const auto refuse = [](Trigger::Request&, Trigger::Response&) -> bool {
    throw RefusedCall("not loaded");
  };
  const Sent sent = call<Trigger>(guard, refuse, {});
  EXPECT_FALSE(sent.is_answer);
  EXPECT_EQ(sent.words, "not loaded");
  EXPECT_EQ(guard.numFailures(), 0U);
  EXPECT_EQ(guard.numRefused(), 0U) << "its bytes are in order";
}

TEST(CheckedSubscription, HandsNoDamagedMessageOn) {
  CallbackGuard guard;
  using Cloud = sensor_msgs::PointCloud2;
  CheckedSubscription<Cloud> subscription(guard, "cloud_in",
                                          [](const ros::MessageEvent<const Cloud>&) {});
  Cloud cloud;
  cloud.data = {1, 2, 3};
  auto bytes = toBytes(cloud);
  const auto deserialize = [&] {
    ros::SubscriptionCallbackHelperDeserializeParams params;
    params.buffer = bytes.data();
    params.length = static_cast<std::uint32_t>(bytes.size());
    return boost::static_pointer_cast<const Cloud>(subscription.deserialize(params));
  };
  ASSERT_NE(deserialize(), nullptr);
  EXPECT_EQ(deserialize()->data, cloud.data);
  claim(bytes, bytes.size() - 8, 1U << 31);  // The data: before them and is_dense.
  EXPECT_EQ(deserialize(), nullptr);
  EXPECT_EQ(guard.numRefused(), 1U);
  EXPECT_EQ(guard.lastRefused(),
            "cloud_in: an array claims 2147483648 elements, with 4 bytes left");
}

}  // namespace
}  // namespace cuboid_mapping_ros
