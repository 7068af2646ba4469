// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/node_handle.h>
#include <ros/service_client.h>

#include <chrono>
#include <condition_variable>
#include <list>
#include <mutex>
#include <string>

namespace cuboid_mapping_ros {

/// Calls services, and can end running calls: roscpp waits for ever for a service that is connected and silent.
/// Thread-safe.
class ServiceCalls {
 public:
  /// @return false without an answer, if the service refuses, or after stop().
  template <typename ServiceT>
  [[nodiscard]] bool call(ros::NodeHandle& nh, const std::string& name, ServiceT& service) {
    const Running running(*this, nh.serviceClient<ServiceT>(name, /*persistent=*/true));
    return running.mayCall() && running.client->call(service);
  }

  /// Ends all calls and refuses later ones. Returns when none is running.
  void stop() {
    std::unique_lock<std::mutex> lock(mutex_);
    is_stopped_ = true;
    while (!clients_.empty()) {
      for (ros::ServiceClient& client : clients_) client.shutdown();
      ended_.wait_for(lock, std::chrono::milliseconds(50));  // Another call may just have begun.
    }
  }

 private:
  using Clients = std::list<ros::ServiceClient>;

  struct Running {
    Running(ServiceCalls& of, const ros::ServiceClient& called) : calls(of) {
      const std::lock_guard<std::mutex> lock(calls.mutex_);
      client = calls.clients_.insert(calls.clients_.end(), called);
    }
    ~Running() {
      const std::lock_guard<std::mutex> lock(calls.mutex_);
      calls.clients_.erase(client);
      calls.ended_.notify_all();
    }
    Running(const Running&) = delete;
    Running& operator=(const Running&) = delete;
    [[nodiscard]] bool mayCall() const {
      const std::lock_guard<std::mutex> lock(calls.mutex_);
      return !calls.is_stopped_;
    }
    ServiceCalls& calls;
    Clients::iterator client;
  };

  std::mutex mutex_;
  std::condition_variable ended_;
  bool is_stopped_ = false;
  /// Running calls: persistent, since only these can be shut down while they wait.
  Clients clients_;
};

}  // namespace cuboid_mapping_ros
