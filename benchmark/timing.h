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

/// CPU time of one of several equal pieces of work, in seconds: so many that the clock can tell.
/// @param work  () -> double, whose results are used, so that the compiler cannot leave it out.
template <typename WorkT>
double cpuTimeOfOne_s(WorkT work) {
  constexpr double kLongEnough_s = 0.02;
  double sum = 0.0;
  double cpu_s = 0.0;
  int times = 0;
  do {
    cpu_s += timeOf([&] { sum += work(); }).cpu_s;
    ++times;
  } while (cpu_s < kLongEnough_s);
  return sum == 0.5 ? 0.0 : cpu_s / times;
}

/// The value that a ratio of all values does not exceed (nearest rank); 0 when there are none.
/// @param ratio  0 to 1: 0.5 is the median, the greater one of the two in the middle.
[[nodiscard]] double quantile(std::vector<double> values, double ratio);

/// quantile(values, 0.5).
[[nodiscard]] double median(std::vector<double> values);

/// Bytes that the C library's heap has given out and not got back.
///
/// Blocks with their headers, so the difference before and after an object is destroyed is what it
/// cost. 0 where the allocator is another one, as under AddressSanitizer.
[[nodiscard]] std::size_t heapBytes();

}  // namespace cuboid_mapping::bench
