// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <condition_variable>
#include <cstdint>
#include <mutex>

namespace cuboid_mapping_ros {

/// A mutex that threads get in the order of their requests: a thread that takes it again and again starves nobody.
class FairMutex {
 public:
  void lock() {
    std::unique_lock<std::mutex> lock(mutex_);
    const std::uint64_t turn = num_asked_++;
    gone_.wait(lock, [&] { return turn == num_gone_; });
  }
  void unlock() {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      ++num_gone_;
    }
    gone_.notify_all();
  }

 private:
  std::mutex mutex_;
  std::condition_variable gone_;
  std::uint64_t num_asked_ = 0;
  std::uint64_t num_gone_ = 0;
};

}  // namespace cuboid_mapping_ros
