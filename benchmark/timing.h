// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <vector>

namespace cuboid_mapping::bench {

/// CPU and wall time of a piece of work.
struct Timing {
  double cpu_s = 0.0;  ///< Of all threads of this process.
  double wall_s = 0.0;
};

inline Timing& operator+=(Timing& sum, const Timing& part) {
  sum.cpu_s += part.cpu_s;
  sum.wall_s += part.wall_s;
  return sum;
}

/// CPU time of this process so far.
[[nodiscard]] double cpuTime_s();

/// Runs the work once.
template <typename WorkT>
Timing timeOf(WorkT work) {
  const auto wall_start = std::chrono::steady_clock::now();
  const double cpu_start_s = cpuTime_s();
  work();
  return {cpuTime_s() - cpu_start_s,
          std::chrono::duration<double>(std::chrono::steady_clock::now() - wall_start).count()};
}

/// CPU time in which queries of a kind are repeated, at least, so that the clock can tell and caches are warm.
constexpr double kTimedQueries_s = 0.2;

/// CPU time of one of several equal pieces of work, in seconds; the first warms up and does not count.
/// @param work  () -> double, whose results are used, so that the compiler cannot leave it out.
/// @param min_cpu_s  All of them take at least this long.
template <typename WorkT>
double cpuTimeOfOne_s(WorkT work, double min_cpu_s = kTimedQueries_s) {
  double sum = work();
  double cpu_s = 0.0;
  int times = 0;
  do {
    cpu_s += timeOf([&] { sum += work(); }).cpu_s;
    ++times;
  } while (cpu_s < min_cpu_s);
  return sum == 0.5 ? 0.0 : cpu_s / times;
}

/// The value that a ratio of all values does not exceed (nearest rank); 0 when there are none.
/// @param ratio  0 to 1: 0.5 is the median, the greater one of the two in the middle.
[[nodiscard]] double quantile(std::vector<double> values, double ratio);

/// quantile(values, 0.5).
[[nodiscard]] double median(std::vector<double> values);

/// Bytes that the C library's heap has given out and not got back, in the arenas of all threads.
///
/// Blocks with their headers, so the difference before and after an object is destroyed is what it
/// cost. 0 without the GNU C library; always the same where its heap is not used, as under AddressSanitizer.
[[nodiscard]] std::size_t heapBytes();

}  // namespace cuboid_mapping::bench
