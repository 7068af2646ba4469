// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/parallel/parallel_for.h"

#include <pthread.h>

#include <algorithm>
#include <condition_variable>
#include <deque>
#include <exception>
#include <memory>
#include <mutex>
#include <thread>
#include <utility>

namespace cuboid_mapping {

/// Steps of one call, shared by threads. The pool's mutex guards all members.
struct BackgroundWork::Job {
  std::function<void(std::size_t)> work;
  std::size_t count;
  std::size_t max_helpers;  ///< Maximum number of pool threads that take part at a time.
  std::size_t next = 0;
  std::size_t num_helpers = 0;
  std::size_t num_running = 0;  ///< Number of steps under way.
  std::exception_ptr error;

  [[nodiscard]] bool wantsHelper() const { return next < count && num_helpers < max_helpers; }
  /// Of BackgroundWork: parallelFor() does a single step itself.
  [[nodiscard]] bool runsInBackground() const { return count == 1 && num_running > 0; }
  [[nodiscard]] bool isDone() const { return next >= count && num_running == 0; }
};

/// The threads of the program.
class ThreadPool {
 public:
  using Job = BackgroundWork::Job;

  /// Never destroyed: static objects may need it after any destructor of ours. The library is never unloaded.
  static ThreadPool& instance() {
    static ThreadPool* pool = new ThreadPool;
    // A forked process has none of the threads, and could not end what they have begun.
    static const int kIsWatched =
        pthread_atfork([] { pool->lockBetweenBackgroundWork(); }, [] { pool->mutex_.unlock(); },
                       [] { pool = new ThreadPool; });
    (void)kIsWatched;
    return *pool;
  }

  std::shared_ptr<Job> start(std::size_t count, std::size_t max_helpers,
                             std::function<void(std::size_t)> work) {
    auto job = std::make_shared<Job>();
    job->work = std::move(work);
    job->count = count;
    job->max_helpers = max_helpers;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      startThreads(max_helpers);
      jobs_.push_back(job);  // Last: no thread may work for a caller that an exception has reached.
    }
    changed_.notify_all();
    return job;
  }

  /// Takes part in a job until it is done.
  void finish(Job& job) {
    std::unique_lock<std::mutex> lock(mutex_);
    takeSteps(job, lock);
    changed_.wait(lock, [&job] { return job.isDone(); });
    jobs_.erase(std::remove_if(jobs_.begin(), jobs_.end(),
                               [&job](const auto& other) { return other.get() == &job; }),
                jobs_.end());
    if (job.error) std::rethrow_exception(std::exchange(job.error, nullptr));
  }

 private:
  /// Locks the mutex when no step of BackgroundWork is under way. @pre The caller is no such step.
  void lockBetweenBackgroundWork() {
    std::unique_lock<std::mutex> lock(mutex_);
    changed_.wait(lock, [this] {
      return std::none_of(jobs_.begin(), jobs_.end(),
                          [](const auto& job) { return job->runsInBackground(); });
    });
    lock.release();
  }

  /// Starts threads up to this number, if the machine and its memory allow it.
  void startThreads(std::size_t count) {
    while (num_threads_ < count) {
      try {
        std::thread([this] { run(); }).detach();
        ++num_threads_;
      } catch (const std::exception&) {
        return;
      }
    }
  }

  [[noreturn]] void run() {
    std::unique_lock<std::mutex> lock(mutex_);
    while (true) {
      const auto found = std::find_if(jobs_.begin(), jobs_.end(),
                                      [](const auto& job) { return job->wantsHelper(); });
      if (found == jobs_.end()) {
        changed_.wait(lock);
        continue;
      }
      const std::shared_ptr<Job> job = *found;
      ++job->num_helpers;
      takeSteps(*job, lock);
      --job->num_helpers;
    }
  }

  /// Does steps until all have been started.
  void takeSteps(Job& job, std::unique_lock<std::mutex>& lock) {
    while (job.next < job.count) {
      const std::size_t step = job.next++;
      ++job.num_running;
      lock.unlock();
      std::exception_ptr error;
      try {
        job.work(step);
      } catch (...) {
        error = std::current_exception();
      }
      lock.lock();
      --job.num_running;
      if (error) {
        job.error = error;
        job.next = job.count;
      }
    }
    if (job.isDone()) changed_.notify_all();
  }

  std::mutex mutex_;
  std::condition_variable changed_;  ///< Notified when a job has come or is done.
  std::deque<std::shared_ptr<Job>> jobs_;
  std::size_t num_threads_ = 0;
};

void parallelFor(std::size_t count, int threads, const std::function<void(std::size_t)>& work) {
  const auto most = static_cast<std::size_t>(std::max(threads, 1));
  if (most == 1 || count < 2) {
    for (std::size_t i = 0; i < count; ++i) work(i);
    return;
  }
  ThreadPool& pool = ThreadPool::instance();
  pool.finish(*pool.start(count, std::min(most, count) - 1, work));
}

BackgroundWork::BackgroundWork(const std::function<void()>& work)
    : job_(ThreadPool::instance().start(1, 1, [work](std::size_t) { work(); })) {}

BackgroundWork::~BackgroundWork() {
  try {
    wait();
  } catch (...) {  // NOLINT: see the header
  }
}

void BackgroundWork::wait() {
  if (job_ == nullptr) return;
  const std::shared_ptr<Job> job = std::exchange(job_, nullptr);
  ThreadPool::instance().finish(*job);
}

}  // namespace cuboid_mapping
