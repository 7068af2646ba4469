// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/service.h>

#include <chrono>
#include <functional>
#include <future>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>

namespace cuboid_mapping_rviz {

/// Calls a service. @throws std::runtime_error  without an answer.
template <typename ServiceT>
typename ServiceT::Response call(const std::string& name, typename ServiceT::Request request) {
  typename ServiceT::Response response;
  if (!ros::service::exists(name, false)) throw std::runtime_error("nobody offers " + name);
  if (!ros::service::call(name, request, response)) {
    throw std::runtime_error(name + " has ended without an answer");
  }
  return response;
}

/// As above, for a service whose answer has an AnswerInfo. @throws std::runtime_error  also for a refusal.
template <typename ServiceT>
typename ServiceT::Response callAnswered(const std::string& name,
                                         const typename ServiceT::Request& request) {
  auto response = call<ServiceT>(name, request);
  if (!response.info.success) throw std::runtime_error(response.info.message);
  return response;
}

/// Calls services in threads of their own, one at a time. rviz does not wait for them, and may be closed
/// meanwhile.
template <typename AnswerT>
class ServiceCaller {
 public:
  /// Whether start() would do nothing.
  [[nodiscard]] bool isBusy() const { return answer_.valid(); }
  /// Calls `work` in a thread, unless it is busy.
  void start(std::function<AnswerT()> work) {
    if (isBusy()) return;
    std::packaged_task<AnswerT()> task(std::move(work));
    answer_ = task.get_future();  // Its destructor does not wait for the thread.
    std::thread(std::move(task)).detach();
  }
  /// Whether take() has an answer.
  [[nodiscard]] bool isDone() const {
    return isBusy() && answer_.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
  }
  /// The answer, once. @pre isDone(). Throws the exception of the work.
  AnswerT take() { return answer_.get(); }

 private:
  std::future<AnswerT> answer_;
};

}  // namespace cuboid_mapping_rviz
