// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/callback_queue.h>
#include <ros/callback_queue_interface.h>
#include <ros/node_handle.h>
#include <ros/spinner.h>

#include <cstdint>
#include <exception>
#include <mutex>
#include <string>

namespace cuboid_mapping_ros {

/// Runs callbacks so that no exception leaves them: it would end the process, and with it every nodelet of a
/// manager.
///
/// A failure is counted and logged; one that repeats the last, every 10 s at most. Thread-safe.
class CallbackGuard {
 public:
  /// @param name  Name of the work, for the log.
  /// @return Whether it ended without an exception.
  template <typename WorkT>
  bool run(const std::string& name, const WorkT& work) noexcept {
    try {
      work();
      return true;
    } catch (const std::exception& exception) {
      noteFailure(name, exception.what());
    } catch (...) {
      noteFailure(name, "an exception that is not a std::exception");
    }
    return false;
  }

  /// Notes a failure that the caller has caught itself, in order to answer.
  void noteFailure(const std::string& name, const char* what) noexcept;

  [[nodiscard]] std::uint64_t numFailures() const;
  /// Name and exception of the last failure; empty before the first.
  [[nodiscard]] std::string lastFailure() const;

 private:
  mutable std::mutex mutex_;
  std::uint64_t num_failures_ = 0;
  std::string last_failure_;
  ros::SteadyTime last_logged_;
};

/// Passes callbacks on to another queue, each within a guard: subscriptions, services, connections,
/// timers and everything else that roscpp calls.
///
/// Every node handle of the package has such a queue, which test_callback_guard checks in the sources.
/// Thread-safe.
class GuardedQueue : public ros::CallbackQueueInterface {
 public:
  /// @param queue, guard  Must outlive this object and the callbacks in the queue.
  /// @param name  Name for the log.
  GuardedQueue(ros::CallbackQueueInterface& queue, CallbackGuard& guard, std::string name);

  void addCallback(const ros::CallbackInterfacePtr& callback,
                   std::uint64_t removal_id = 0) override;
  void removeByID(std::uint64_t removal_id) override;

  [[nodiscard]] CallbackGuard& guard() { return guard_; }

 private:
  ros::CallbackQueueInterface& queue_;
  CallbackGuard& guard_;
  std::string name_;
};

/// A guarded queue with one or more threads that work on it.
class GuardedThread {
 public:
  /// @param guard  Must outlive this object. @param num_threads  > 0; with more than one, callbacks
  /// run side by side.
  GuardedThread(CallbackGuard& guard, const std::string& name, std::uint32_t num_threads = 1)
      : queue_(callbacks_, guard, name), spinner_(num_threads, &callbacks_) {}

  [[nodiscard]] GuardedQueue& queue() { return queue_; }
  void start() { spinner_.start(); }
  /// Stops the threads; returns when no callback runs any more.
  void stop() { spinner_.stop(); }

 private:
  ros::CallbackQueue callbacks_;
  GuardedQueue queue_;
  ros::AsyncSpinner spinner_;  ///< Last member: its thread ends before the queue is destroyed.
};

/// A copy of the handle that uses the queue for callbacks.
[[nodiscard]] ros::NodeHandle withQueue(const ros::NodeHandle& nh, GuardedQueue& queue);

/// The guard of a handle's queue. @throws std::logic_error when the handle has no GuardedQueue.
[[nodiscard]] CallbackGuard& guardOf(const ros::NodeHandle& nh);

}  // namespace cuboid_mapping_ros
