// SPDX-License-Identifier: BSD-3-Clause
#include "timing.h"

#include <malloc.h>

#include <algorithm>
#include <cmath>
#include <ctime>

namespace cuboid_mapping::bench {

double cpuTime_s() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

double quantile(std::vector<double> values, double ratio) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  const auto rank = static_cast<std::size_t>(ratio * static_cast<double>(values.size()));
  return values[std::min(rank, values.size() - 1)];
}

double median(std::vector<double> values) { return quantile(std::move(values), 0.5); }

std::size_t heapBytes() {
#if defined(__GLIBC__) && (__GLIBC__ > 2 || (__GLIBC__ == 2 && __GLIBC_MINOR__ >= 33))
  const struct mallinfo2 info = mallinfo2();
  return info.uordblks + info.hblkhd;
#else
  // Its numbers are int, and wrap: differences are right up to 4 GB.
  const struct mallinfo info = mallinfo();
  return static_cast<unsigned>(info.uordblks) + static_cast<unsigned>(info.hblkhd);
#endif
}

}  // namespace cuboid_mapping::bench
