// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/map/phase_fair_mutex.h"

#include <cassert>

namespace cuboid_mapping_ros {

void PhaseFairMutex::lock() {
  std::unique_lock<std::mutex> lock(mutex_);
  assert(!has_writer_);
  has_writer_ = true;
  generation_ = 1 - generation_;
  is_closed_ = numEarlier() == 0;
  may_write_.wait(lock, [this] { return is_closed_ && numReaders(generation_) == 0; });
}

void PhaseFairMutex::unlock() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    has_writer_ = false;
    is_closed_ = false;
    ++num_written_;
    numReaders(generation_) += num_waiting_;
    num_waiting_ = 0;
  }
  may_read_.notify_all();
}

int PhaseFairMutex::lockShared(bool is_long) {
  std::unique_lock<std::mutex> lock(mutex_);
  const int generation = generation_;
  if (is_closed_ || (is_long && has_writer_)) {
    ++num_waiting_;  // unlock() admits waiting readers: the next writer cannot overtake them.
    may_read_.wait(lock, [this, before = num_written_] { return num_written_ != before; });
  } else {
    ++numReaders(generation);
  }
  return generation;
}

void PhaseFairMutex::unlockShared(int generation) {
  const std::lock_guard<std::mutex> lock(mutex_);
  --numReaders(generation);
  if (!has_writer_ || numEarlier() > 0) return;
  is_closed_ = true;
  if (numReaders(generation_) == 0) may_write_.notify_one();
}

}  // namespace cuboid_mapping_ros
