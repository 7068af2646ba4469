// SPDX-License-Identifier: BSD-3-Clause
// Requests and messages from outside: the length that an array claims is compared with the bytes that
// are there. roscpp makes the array first, so that a request of 100 bytes can ask for 16 GB.
#pragma once

#include "cuboid_mapping/ros/middleware/callback_guard.h"

#include <ros/advertise_service_options.h>
#include <ros/message_event.h>
#include <ros/node_handle.h>
#include <ros/serialization.h>
#include <ros/service_client.h>
#include <ros/service_server.h>
#include <ros/subscribe_options.h>
#include <ros/subscriber.h>

#include <boost/function.hpp>
#include <boost/make_shared.hpp>

#include <chrono>
#include <cstdint>
#include <exception>
#include <future>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace cuboid_mapping_ros {

/// A stream of roscpp's that reads an array only if its elements can be in the bytes that are left.
class CheckedStream : public ros::serialization::IStream {
 public:
  using IStream::IStream;

  /// @throws ros::serialization::StreamOverrunException when the bytes do not suffice.
  template <typename T>
  void next(T& value) {
    ros::serialization::deserialize(*this, value);
  }
  template <typename T, typename AllocatorT>
  void next(std::vector<T, AllocatorT>& values) {
    CheckedStream ahead(getData(), getLength());
    std::uint32_t count = 0;
    ahead.next(count);
    // Arrays and strings in an element are empty here: none has fewer bytes.
    const std::uint64_t num_bytes =
        std::uint64_t{count} * ros::serialization::serializationLength(T());
    if (num_bytes > ahead.getLength()) {
      throwOverrun(count, ahead.getLength());
    }
    ros::serialization::deserialize(*this, values);
  }

 private:
  [[noreturn]] static void throwOverrun(std::uint32_t count, std::uint32_t num_bytes_left);
};

/// Reads a message. @throws ros::serialization::StreamOverrunException when bytes are missing.
template <typename MessageT>
void readChecked(std::uint8_t* bytes, std::size_t num_bytes, MessageT& message) {
  std::uint8_t nothing = 0;  // roscpp counts on from where a message of no bytes is.
  CheckedStream(bytes != nullptr ? bytes : &nothing, static_cast<std::uint32_t>(num_bytes))
      .next(message);
}

/// Thrown by a service whose answer has no place for a message: the call fails, and its caller is told why. Unlike
/// other exceptions it is no failure of the node's.
class RefusedCall : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// What is sent to the caller of a service that has failed.
[[nodiscard]] ros::SerializedMessage makeRefusal(const std::string& why);
/// An error of a service's name.
void logRefusal(const std::string& name, const char* why) noexcept;

/// Calls a service for roscpp. A request that cannot be deserialized is refused and counted, an exception of the
/// service is counted unless it is a RefusedCall, which is logged; in all cases the caller is told that the call
/// has failed, and why.
template <typename RequestT, typename ResponseT>
class CheckedService : public ros::ServiceCallbackHelper {
 public:
  using Answer = boost::function<bool(RequestT&, ResponseT&)>;

  /// @param guard  Must outlive this object.
  CheckedService(CallbackGuard& guard, std::string name, Answer answer)
      : guard_(guard), name_(std::move(name)), answer_(std::move(answer)) {}

  bool call(ros::ServiceCallbackHelperCallParams& params) override {
    RequestT request;
    try {
      const ros::SerializedMessage& bytes = params.request;
      const auto begin = static_cast<std::size_t>(bytes.message_start - bytes.buf.get());
      readChecked(bytes.message_start, bytes.num_bytes - begin, request);
    } catch (const std::exception& exception) {
      guard_.noteRefused(name_, exception.what());
      return refuse(params, std::string("the request is damaged: ") + exception.what());
    }
    try {
      ResponseT response;
      if (!answer_(request, response)) return refuse(params, {});
      params.response = ros::serialization::serializeServiceResponse(true, response);
      return true;
    } catch (const RefusedCall& refusal) {
      logRefusal(name_, refusal.what());
      return refuse(params, refusal.what());
    } catch (const std::exception& exception) {
      guard_.noteFailure(name_, exception.what());
      return refuse(params, exception.what());
    } catch (...) {
      guard_.noteFailure(name_, CallbackGuard::kUnknownException);
      return refuse(params, CallbackGuard::kUnknownException);
    }
  }

 private:
  static bool refuse(ros::ServiceCallbackHelperCallParams& params, const std::string& why) {
    params.response = makeRefusal(why);
    return false;
  }

  CallbackGuard& guard_;
  std::string name_;
  Answer answer_;
};

/// Hands messages of a topic on. One that cannot be deserialized is refused and counted.
template <typename MessageT>
class CheckedSubscription
    : public ros::SubscriptionCallbackHelperT<const ros::MessageEvent<const MessageT>&> {
 public:
  using Base = ros::SubscriptionCallbackHelperT<const ros::MessageEvent<const MessageT>&>;
  using Take = typename Base::Callback;

  /// @param guard  Must outlive this object.
  CheckedSubscription(CallbackGuard& guard, std::string topic, const Take& take)
      : Base(take), guard_(guard), topic_(std::move(topic)) {}

  /// @return nullptr when it is refused: roscpp then calls nobody.
  ros::VoidConstPtr deserialize(
      const ros::SubscriptionCallbackHelperDeserializeParams& params) override {
    try {
      const auto message = boost::make_shared<MessageT>();
      readChecked(params.buffer, params.length, *message);
      return message;
    } catch (const std::exception& exception) {
      guard_.noteRefused(topic_, exception.what());
      return {};
    }
  }

 private:
  CallbackGuard& guard_;
  std::string topic_;
};

/// Offers a service. roscpp swallows what its callbacks throw, so that the queue cannot count it.
/// @param answer  false, or an exception: the caller is told that the call has failed.
/// @throws std::logic_error when the handle has no GuardedQueue.
template <typename RequestT, typename ResponseT>
[[nodiscard]] ros::ServiceServer advertiseGuarded(
    ros::NodeHandle& nh, const std::string& name,
    boost::function<bool(RequestT&, ResponseT&)> answer) {
  ros::AdvertiseServiceOptions options;
  options.init<RequestT, ResponseT>(name, answer);
  options.helper =
      boost::make_shared<CheckedService<RequestT, ResponseT>>(guardOf(nh), name, std::move(answer));
  return nh.advertiseService(options);
}

/// How long a service that has taken a request may be silent.
constexpr std::chrono::seconds kCallLimit{10};

/// Ends calls of a service that last too long: roscpp waits for ever for one that is connected and silent.
class CallDeadline {
 public:
  /// @param client  A persistent one: only these can be disconnected while they wait.
  /// @throws std::system_error  when there is no thread for it.
  CallDeadline(ros::ServiceClient client, std::chrono::milliseconds limit);
  ~CallDeadline();
  CallDeadline(const CallDeadline&) = delete;
  CallDeadline& operator=(const CallDeadline&) = delete;

 private:
  std::promise<void> is_over_;
  std::thread thread_;
};

/// Calls a service. @param error  Why there is no answer.
/// @return false when nobody has answered within the limit, or what came is none.
template <typename ServiceT>
[[nodiscard]] bool callChecked(ros::NodeHandle& nh, const std::string& name, ServiceT& service,
                               std::string& error, std::chrono::milliseconds limit = kCallLimit) {
  namespace traits = ros::service_traits;
  ros::ServiceClient client = nh.serviceClient<ServiceT>(name, /*persistent=*/true);
  const CallDeadline deadline(client, limit);
  ros::SerializedMessage answer;
  if (!client.call(ros::serialization::serializeMessage(service.request), answer,
                   traits::md5sum<ServiceT>())) {
    error = "no answer from " + nh.resolveName(name);
    return false;
  }
  try {
    const auto begin = static_cast<std::size_t>(answer.message_start - answer.buf.get());
    readChecked(answer.message_start, answer.num_bytes - begin, service.response);
    return true;
  } catch (const std::exception& exception) {
    error = "the answer of " + nh.resolveName(name) + " is damaged: " + exception.what();
    return false;
  }
}

/// How a topic is listened to.
struct Listening {
  std::uint32_t queue_size = 0;    ///< Messages that wait; 0: any number.
  bool runs_side_by_side = false;  ///< `take` may be called again while it runs.
};

/// Listens to a topic. @param take  (const ros::MessageEvent<const MessageT>&) -> void.
/// @throws std::logic_error when the handle has no GuardedQueue.
template <typename MessageT, typename TakeT>
[[nodiscard]] ros::Subscriber subscribeGuarded(ros::NodeHandle& nh, const std::string& topic,
                                               const Listening& listening, TakeT take) {
  using Subscription = CheckedSubscription<MessageT>;
  const typename Subscription::Take callback(std::move(take));
  ros::SubscribeOptions options;
  options.initByFullCallbackType<const ros::MessageEvent<const MessageT>&>(
      topic, listening.queue_size, callback);
  options.helper = boost::make_shared<Subscription>(guardOf(nh), topic, callback);
  options.allow_concurrent_callbacks = listening.runs_side_by_side;
  return nh.subscribe(options);
}

}  // namespace cuboid_mapping_ros
