// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/parallel/parallel_for.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <iostream>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace cuboid_mapping {
namespace {

/// Steps that wait for each other, for ten seconds at most.
class Meeting {
 public:
  explicit Meeting(int count) : num_awaited_(count) {}

  /// Waits for the others. @return Whether all came.
  bool come() {
    --num_awaited_;
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(10);
    while (num_awaited_ > 0 && std::chrono::steady_clock::now() < end) std::this_thread::yield();
    return num_awaited_ <= 0;
  }

 private:
  std::atomic<int> num_awaited_;
};

/// Whether a call of parallelFor() with this number of threads has as many at a time.
bool haveThreads(int threads) {
  Meeting meeting(threads);
  std::atomic<int> num_met{0};
  parallelFor(static_cast<std::size_t>(threads), threads,
              [&](std::size_t) { num_met += meeting.come() ? 1 : 0; });
  return num_met == threads;
}

TEST(ParallelFor, doesEachStepOnce) {
  for (const int threads : {-1, 0, 1, 2, 3, 16}) {
    for (const std::size_t count : {0U, 1U, 2U, 3U, 1000U}) {
      std::vector<std::atomic<int>> times(count);
      parallelFor(count, threads, [&](std::size_t i) { ++times[i]; });
      for (std::size_t i = 0; i < count; ++i) {
        ASSERT_EQ(times[i], 1) << "step " << i << " of " << count << ", " << threads << " threads";
      }
    }
  }
}

TEST(ParallelFor, usesAsManyThreadsAsItMay) {
  for (const int threads : {2, 3, 5}) EXPECT_TRUE(haveThreads(threads)) << threads;
}

/// As Python's multiprocessing does: the child has the pool without its threads.
TEST(ParallelFor, hasThreadsInAForkedProcess) {
#ifdef __SANITIZE_THREAD__
  GTEST_SKIP() << "ThreadSanitizer allows no threads after a fork";
#endif
  EXPECT_TRUE(haveThreads(3));
  const pid_t child = fork();
  if (child == 0) {
    alarm(20);  // Ends a child that hangs.
    bool are_there = true;
    for (int i = 0; i < 20; ++i) are_there = haveThreads(3) && are_there;
    _exit(are_there ? 0 : 1);
  }
  int status = -1;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0);
}

/// The child has the work's result, but not its thread, and would wait for it forever.
TEST(BackgroundWork, isDoneBeforeAProcessForks) {
  for (int i = 0; i < 20; ++i) {
    std::atomic<bool> is_begun{false};
    std::atomic<bool> is_done{false};
    BackgroundWork work([&] {
      is_begun = true;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
      is_done = true;
    });
    const bool begins_before = i % 2 == 0;
    while (begins_before && !is_begun) std::this_thread::yield();
    const pid_t child = fork();
    if (child == 0) {
      alarm(5);  // Ends a child that hangs.
      work.wait();
      _exit(is_done ? 0 : 1);
    }
    work.wait();
    int status = -1;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    ASSERT_EQ(status, 0) << "fork " << i;
  }
}

TEST(ParallelFor, staysOnTheCallersThreadWithoutHelpers) {
  for (const int threads : {-1, 0, 1}) {
    const std::thread::id caller = std::this_thread::get_id();
    parallelFor(100, threads,
                [&](std::size_t) { ASSERT_EQ(std::this_thread::get_id(), caller) << threads; });
  }
  parallelFor(1, 8, [caller = std::this_thread::get_id()](std::size_t) {
    EXPECT_EQ(std::this_thread::get_id(), caller) << "a single step";
  });
}

/// The exception of any step, the caller's or a helper's, comes out when no step is running any more.
TEST(ParallelFor, throwsTheExceptionOfAStepWhenAllHaveEnded) {
  for (const int threads : {1, 2, 4}) {
    for (std::size_t bad = 0; bad < 8; ++bad) {
      std::atomic<int> num_running{0};
      std::atomic<int> num_started{0};
      try {
        parallelFor(8, threads, [&](std::size_t i) {
          ++num_running;
          ++num_started;
          std::this_thread::yield();
          --num_running;
          if (i == bad) throw std::runtime_error("step " + std::to_string(i));
        });
        ADD_FAILURE() << "step " << bad << ", " << threads << " threads: no exception";
      } catch (const std::runtime_error& error) {
        EXPECT_EQ(error.what(), "step " + std::to_string(bad));
        EXPECT_EQ(num_running, 0);
        EXPECT_GT(num_started, static_cast<int>(bad));
      }
    }
  }
  EXPECT_TRUE(haveThreads(4)) << "no thread has gone with an exception";
}

TEST(ParallelFor, throwsAnExceptionOfAHelper) {
  const std::thread::id caller = std::this_thread::get_id();
  Meeting meeting(2);
  EXPECT_THROW(parallelFor(2, 2,
                           [&](std::size_t) {
                             ASSERT_TRUE(meeting.come());
                             if (std::this_thread::get_id() != caller) {
                               throw std::runtime_error("in a helper");
                             }
                           }),
               std::runtime_error);
}

TEST(ParallelFor, worksInsideItselfAndSideBySide) {
  std::vector<std::thread> callers;
  std::atomic<int> num_done{0};
  for (int caller = 0; caller < 4; ++caller) {
    callers.emplace_back([&] {
      parallelFor(4, 3, [&](std::size_t) {
        parallelFor(5, 4,
                    [&](std::size_t) { parallelFor(6, 2, [&](std::size_t) { ++num_done; }); });
      });
    });
  }
  for (std::thread& caller : callers) caller.join();
  EXPECT_EQ(num_done, 4 * 4 * 5 * 6);
}

TEST(ParallelFor, throwsAnExceptionFromWithinItself) {
  EXPECT_THROW(parallelFor(4, 4,
                           [](std::size_t) {
                             parallelFor(4, 4, [](std::size_t i) {
                               if (i == 2) throw std::runtime_error("deep");
                             });
                           }),
               std::runtime_error);
}

TEST(BackgroundWork, runsBesideItsCaller) {
  Meeting meeting(2);
  std::atomic<bool> have_met{false};
  BackgroundWork work([&] { have_met = meeting.come(); });
  EXPECT_TRUE(meeting.come());
  work.wait();
  EXPECT_TRUE(have_met);
  work.wait();  // There is nothing to wait for any more.
}

TEST(BackgroundWork, throwsItsExceptionOnceAndOnlyWhenWaitedFor) {
  BackgroundWork work([] { throw std::runtime_error("said once"); });
  EXPECT_THROW(work.wait(), std::runtime_error);
  EXPECT_NO_THROW(work.wait());
  EXPECT_NO_THROW(BackgroundWork([] { throw std::runtime_error("never said"); }));
}

TEST(BackgroundWork, hasEndedWhenItIsDestroyed) {
  std::atomic<int> num_done{0};
  for (int i = 0; i < 100; ++i) {
    const BackgroundWork work([&] {
      std::this_thread::yield();
      ++num_done;
    });
  }
  EXPECT_EQ(num_done, 100);
}

/// A static object that was there before the first thread.
struct UserAtExit {
  ~UserAtExit() {
    if (haveThreads(2)) return;
    std::cerr << "no second thread" << std::endl;
    std::_Exit(1);
  }
};

TEST(ParallelForDeathTest, worksUntilTheLastStaticObjectHasGone) {
  ::testing::FLAGS_gtest_death_test_style = "threadsafe";  // A program of its own.
  EXPECT_EXIT(
      {
        static const UserAtExit user;
        static BackgroundWork work;
        work = BackgroundWork([] { std::this_thread::yield(); });
        std::exit(haveThreads(2) ? 0 : 2);
      },
      ::testing::ExitedWithCode(0), "");
}

}  // namespace
}  // namespace cuboid_mapping
