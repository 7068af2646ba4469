// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <condition_variable>
#include <cstdint>
#include <mutex>

namespace cuboid_mapping_ros {

/// A mutex for many readers, or one writer. Nobody starves:
///   - while a reader from before the writer is active, new readers pass the waiting writer: a long reader
///     delays the writer, but no short readers. Long readers do not pass it: short ones would wait for both;
///   - then the writer is next, once the readers that passed it have left;
///   - after the writer, all waiting readers enter.
///
/// So a writer waits for at most two generations of readers, a reader for the writer and the readers that
/// passed it. See the phase-fair locks of Brandenburg and Anderson, "Spin-Based Reader-Writer Synchronization
/// for Multiprocessor Real-Time Systems", 2010, where the writer waits for one generation and all new readers
/// wait for that as well.
class PhaseFairMutex {
 public:
  /// @pre Only one thread at a time writes, or waits to write.
  void lock();
  void unlock();

  /// @param is_long  The reader stays long. @return The reader's generation, for unlockShared().
  [[nodiscard]] int lockShared(bool is_long = false);
  void unlockShared(int generation);

 private:
  [[nodiscard]] int& numEarlier() {
    return num_readers_[static_cast<std::size_t>(1 - generation_)];
  }
  [[nodiscard]] int& numReaders(int generation) {
    return num_readers_[static_cast<std::size_t>(generation)];
  }

  std::mutex mutex_;
  std::condition_variable may_read_;
  std::condition_variable may_write_;
  std::array<int, 2> num_readers_{};  ///< Readers of each generation.
  int generation_ = 0;       ///< Generation of new readers. Without a writer it has all readers.
  bool has_writer_ = false;  ///< A writer waits, or writes.
  bool is_closed_ = false;   ///< New readers have to wait for the writer.
  int num_waiting_ = 0;      ///< Number of waiting readers.
  std::uint64_t num_written_ = 0;
};

/// A mutex that a thread which takes it again and again gets after the others.
class FairMutex {
 public:
  void lock() {
    const std::lock_guard<std::mutex> next(next_);
    mutex_.lock();
  }
  void unlock() { mutex_.unlock(); }

 private:
  std::mutex next_;  ///< Held by the thread that waits for `mutex_`.
  std::mutex mutex_;
};

}  // namespace cuboid_mapping_ros
