// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <future>
#include <vector>

namespace cuboid_mapping {

/// Calls work(i) once for each i in [0, count), on up to `threads` threads; the caller's is one.
///
/// Blocks until all are done. Which thread takes which i is left open, so that `work` must not
/// depend on it. An exception of `work` is thrown here.
template <typename WorkT>
void parallelFor(std::size_t count, int threads, const WorkT& work) {
  std::atomic<std::size_t> next{0};
  const auto run = [&] {
    for (std::size_t i = next++; i < count; i = next++) work(i);
  };
  std::vector<std::future<void>> others;
  for (std::size_t i = 1; i < std::min(static_cast<std::size_t>(std::max(threads, 1)), count);
       ++i) {
    others.push_back(std::async(std::launch::async, run));
  }
  run();
  for (std::future<void>& other : others) other.get();
}

}  // namespace cuboid_mapping
