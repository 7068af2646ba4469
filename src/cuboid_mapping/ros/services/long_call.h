// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/map/call_progress.h"
#include "cuboid_mapping/ros/middleware/callback_guard.h"
#include "cuboid_mapping/ros/middleware/callbacks.h"

#include <actionlib/server/simple_action_server.h>
#include <ros/node_handle.h>
#include <ros/serialization.h>
#include <ros/service_server.h>

#include <atomic>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

namespace cuboid_mapping_ros {

/// Converts to a message of another type with the same fields.
template <typename ToT, typename FromT>
ToT sameFields(const FromT& from) {
  using To = ros::message_traits::MD5Sum<ToT>;
  using From = ros::message_traits::MD5Sum<FromT>;
  static_assert(
      To::static_value1 == From::static_value1 && To::static_value2 == From::static_value2,
      "goal and result of an action have the fields of the service");
  const ros::SerializedMessage bytes = ros::serialization::serializeMessage(from);
  ros::serialization::IStream stream(
      bytes.message_start,
      static_cast<std::uint32_t>(ros::serialization::serializationLength(from)));
  ToT to;
  ros::serialization::deserialize(stream, to);
  return to;
}

/// A long call: a service, and an action of the same name and fields, which reports its progress and can be
/// cancelled.
///
/// Both do the same work, from one queue. As in every SimpleActionServer, a new goal cancels the previous one.
template <typename ServiceT, typename ActionT>
class LongCall {
 public:
  using Request = typename ServiceT::Request;
  using Response = typename ServiceT::Response;  ///< Has an AnswerInfo `info`.
  /// Fills in the response; a cancelled call has no success.
  using Work = std::function<void(const Request&, Response&, const CallProgress&)>;

  /// @param nh  Its queue takes goals and cancels while work runs, so it needs another thread.
  /// @param queue  Queue of the work; must outlive this object.
  LongCall(const ros::NodeHandle& nh, const std::string& name, GuardedQueue& queue, Work work)
      : name_(name),
        queue_(queue),
        work_(std::move(work)),
        action_(std::in_place, nh, name, false),
        server_(offerService<ServiceT>(withQueue(nh, queue), name,
                                       [this](const Request& request, Response& response) {
                                         work_(request, response, CallProgress());
                                       })) {
    action_->registerPreemptCallback([this] { is_cancelled_ = true; });
    action_->registerGoalCallback([this] { post(queue_, this, [this] { answerGoal(); }); });
    action_->start();
  }
  /// Before it, call cancel(), and stop the threads of the queue: roscpp 1.15 does not wait for a callback that runs.
  ~LongCall() {
    is_stopping_ = true;
    server_.shutdown();
    removePosted(queue_, this);
    action_.reset();
    removePosted(queue_, this);  // A goal may have come meanwhile.
  }
  LongCall(const LongCall&) = delete;
  LongCall& operator=(const LongCall&) = delete;

  /// Cancels the running goal, and takes no other.
  void cancel() { is_stopping_ = true; }

 private:
  using Server = actionlib::SimpleActionServer<ActionT>;
  using Result = typename Server::Result;

  void answerGoal() {
    const std::lock_guard<std::mutex> one_goal_at_a_time(answering_);
    if (is_stopping_ || !action_->isNewGoalAvailable()) return;
    is_cancelled_ = false;
    const auto goal = action_->acceptNewGoal();
    if (action_->isPreemptRequested()) is_cancelled_ = true;
    const bool is_answered = queue_.guard().run(name_, [&] { answer(sameFields<Request>(*goal)); });
    if (!is_answered) action_->setAborted(Result(), "the call failed: see the log of the node");
  }

  void answer(const Request& request) {
    Response response;
    work_(request, response,
          CallProgress([this](const auto& stage, double share) { tell(stage, share); }));
    const auto result = sameFields<Result>(response);
    const std::string& text = response.info.message;
    if (response.info.success != 0) return action_->setSucceeded(result, text);
    is_cancelled_ ? action_->setPreempted(result, text) : action_->setAborted(result, text);
  }

  void tell(const std::string& stage, double share) {
    if (is_stopping_ || is_cancelled_) throw Cancelled();
    constexpr double kPeriod_s = 0.1;
    const ros::WallTime now = ros::WallTime::now();
    if (stage == feedback_.stage && now - told_ < ros::WallDuration(kPeriod_s)) return;
    told_ = now;
    feedback_.stage = stage;
    feedback_.share = static_cast<float>(share);
    action_->publishFeedback(feedback_);
  }

  std::string name_;
  GuardedQueue& queue_;
  Work work_;
  std::mutex answering_;  ///< The queue may have several threads.
  std::atomic<bool> is_stopping_{false};
  std::atomic<bool> is_cancelled_{false};
  typename Server::Feedback feedback_;  ///< Last feedback that was sent.
  ros::WallTime told_;
  std::optional<Server> action_;
  ros::ServiceServer server_;
};

}  // namespace cuboid_mapping_ros
