// SPDX-License-Identifier: BSD-3-Clause
// Work on threads that live as long as the program: they are started when they are first needed.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>

namespace cuboid_mapping {

/// Calls work(i) once for each i in [0, count), on up to `threads` threads; the caller's is one.
///
/// Blocks until all are done. Which thread takes which i is left open, so that `work` must not
/// depend on it. Where no more threads can be started, those that there are do the work. An
/// exception of `work` is thrown here, when no work is under way any more; some i may have been left
/// out then. Calls may run side by side and inside of each other.
void parallelFor(std::size_t count, int threads, const std::function<void(std::size_t)>& work);

/// Work that goes on beside the thread that has started it.
class BackgroundWork {
 public:
  /// Nothing to wait for.
  BackgroundWork() = default;
  /// Starts it. Where no thread can be started, it is done in wait().
  explicit BackgroundWork(const std::function<void()>& work);
  /// Takes over the work of another one, which has nothing to wait for then. Work that this one had
  /// goes on, and nobody waits for it: call wait() before.
  ///@{
  BackgroundWork(BackgroundWork&&) = default;
  BackgroundWork& operator=(BackgroundWork&& other) = default;
  ///@}
  /// Waits; an exception of the work is lost then.
  ~BackgroundWork();

  /// Blocks until the work is done, and takes part in it. Throws what it has thrown, once.
  void wait();

 private:
  struct Job;
  std::shared_ptr<Job> job_;

  friend class ThreadPool;
};

}  // namespace cuboid_mapping
