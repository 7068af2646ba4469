// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/map/phase_fair_mutex.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <mutex>
#include <thread>
#include <vector>

namespace cuboid_mapping_ros {
namespace {

/// Gives a thread time to reach its wait; on a busy machine a test may then detect less.
void letWait() { std::this_thread::sleep_for(std::chrono::milliseconds(20)); }

/// A thread that writes as soon as it may.
std::thread startWriter(PhaseFairMutex& mutex, std::atomic<bool>& is_written) {
  std::thread writer([&] {
    const std::lock_guard<PhaseFairMutex> lock(mutex);
    is_written = true;
  });
  letWait();
  return writer;
}

TEST(PhaseFairMutex, ReadersGoPastAWriterWhoWaitsForAnotherOne) {
  PhaseFairMutex mutex;
  const int long_reader = mutex.lockShared();
  std::atomic<bool> is_written{false};
  std::thread writer = startWriter(mutex, is_written);
  for (int i = 0; i < 3; ++i) mutex.unlockShared(mutex.lockShared());  // A deadlock hangs here.
  EXPECT_FALSE(is_written);
  mutex.unlockShared(long_reader);
  writer.join();
  EXPECT_TRUE(is_written);
}

TEST(PhaseFairMutex, AWriterWaitsForNoMoreThanThoseWhoWentPast) {
  PhaseFairMutex mutex;
  const int first = mutex.lockShared();
  std::atomic<bool> is_written{false};
  std::atomic<bool> has_seen_write{false};
  std::thread writer = startWriter(mutex, is_written);
  const int second = mutex.lockShared();
  mutex.unlockShared(first);
  std::thread third([&] {
    const int generation = mutex.lockShared();
    has_seen_write = is_written.load();
    mutex.unlockShared(generation);
  });
  letWait();
  EXPECT_FALSE(is_written) << "the second still reads";
  mutex.unlockShared(second);
  writer.join();
  third.join();
  EXPECT_TRUE(has_seen_write) << "the third came when the writer was next";
}

TEST(PhaseFairMutex, NobodyWaitsForALongReaderWhoCameAfterTheWriter) {
  PhaseFairMutex mutex;
  const int first = mutex.lockShared();
  std::atomic<bool> is_written{false};
  std::thread writer = startWriter(mutex, is_written);
  std::atomic<bool> is_written_before{false};
  std::thread second([&] {
    const int generation = mutex.lockShared(true);
    is_written_before = is_written.load();
    mutex.unlockShared(generation);
  });
  letWait();
  for (int i = 0; i < 3; ++i) mutex.unlockShared(mutex.lockShared());  // A deadlock hangs here.
  mutex.unlockShared(first);
  writer.join();
  second.join();
  EXPECT_TRUE(is_written_before);
}

TEST(PhaseFairMutex, AReaderWhoWaitsComesBeforeTheNextWriter) {
  PhaseFairMutex mutex;
  constexpr int kRounds = 20;
  int num_before = 0;
  for (int round = 0; round < kRounds; ++round) {
    std::atomic<bool> has_read{false};
    mutex.lock();
    std::thread reader([&] {
      const int generation = mutex.lockShared();
      has_read = true;
      mutex.unlockShared(generation);
    });
    letWait();
    mutex.unlock();
    mutex.lock();
    num_before += has_read ? 1 : 0;
    mutex.unlock();
    reader.join();
  }
  EXPECT_GT(num_before, kRounds / 2) << "a busy machine may start the reader late";
}

TEST(PhaseFairMutex, NobodyReadsWhatIsHalfWritten) {
  PhaseFairMutex mutex;
  std::mutex writers;
  constexpr int kWrites = 2000;
  int halves[2] = {0, 0};
  std::atomic<int> num_torn{0};
  std::vector<std::thread> threads;
  for (int i = 0; i < 2; ++i) {
    threads.emplace_back([&] {
      for (int k = 0; k < kWrites; ++k) {
        const std::lock_guard<std::mutex> turn(writers);
        const std::lock_guard<PhaseFairMutex> lock(mutex);
        ++halves[0];
        std::this_thread::yield();
        ++halves[1];
      }
    });
    threads.emplace_back([&] {
      for (bool is_done = false; !is_done;) {
        const int generation = mutex.lockShared();
        num_torn += halves[0] != halves[1] ? 1 : 0;
        is_done = halves[0] == 2 * kWrites;
        mutex.unlockShared(generation);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(num_torn, 0);
  EXPECT_EQ(halves[1], 2 * kWrites);
}

}  // namespace
}  // namespace cuboid_mapping_ros
