// SPDX-License-Identifier: BSD-3-Clause
#include "timing.h"

#include <malloc.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string_view>

namespace cuboid_mapping::bench {
namespace {

/// A size in the report of malloc_info(): the last of an element's is that of all arenas.
std::size_t sizeIn(std::string_view report, std::string_view element) {
  constexpr std::string_view kSize = "size=\"";
  const std::size_t at = report.find(kSize, report.rfind(element));
  return std::strtoull(report.data() + at + kSize.size(), nullptr, 10);
}

}  // namespace

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
#ifdef __GLIBC__
  static std::array<char, 1 << 20> text;  // Not of the heap, which must stay as it is.
  std::FILE* stream = fmemopen(text.data(), text.size(), "w");
  malloc_info(0, stream);
  std::fclose(stream);
  const std::string_view report(text.data());
  return sizeIn(report, "<system type=\"current\"") + sizeIn(report, "<total type=\"mmap\"") -
         sizeIn(report, "<total type=\"fast\"") - sizeIn(report, "<total type=\"rest\"");
#else
  return 0;
#endif
}

}  // namespace cuboid_mapping::bench
