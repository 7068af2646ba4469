// SPDX-License-Identifier: BSD-3-Clause
// Work on threads that live as long as the program; they start when they are first needed.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>

namespace cuboid_mapping {

/// Calls work(i) once for each i in [0, count), on up to `threads` threads; the caller's is one.
///
/// Blocks until all are done. Any thread may take any i. If no more threads can be started, the existing ones
/// do the work. An exception of `work` is thrown here when no work is running any more; some i may then not
/// have been started. Calls may run side by side, and inside each other.
void parallelFor(std::size_t count, int threads, const std::function<void(std::size_t)>& work);

/// Work that runs beside the thread that has started it. fork() waits until no such work is under way; work that has
/// not begun is done by wait() in the child, too.
class BackgroundWork {
 public:
  /// No work: wait() returns at once.
  BackgroundWork() = default;
  /// Starts work. If no thread can be started, wait() does it.
  explicit BackgroundWork(const std::function<void()>& work);
  /// Takes over the work of another object. Call wait() before: nobody waits for the previous work of this
  /// object.
  ///@{
  BackgroundWork(BackgroundWork&&) = default;
  BackgroundWork& operator=(BackgroundWork&& other) = default;
  ///@}
  /// Waits; an exception of the work is lost.
  ~BackgroundWork();

  /// Blocks until the work is done, and takes part in it. Throws the exception of the work, once.
  void wait();

 private:
  struct Job;
  std::shared_ptr<Job> job_;

  friend class ThreadPool;
};

}  // namespace cuboid_mapping
