// SPDX-License-Identifier: BSD-3-Clause
#include "peak_memory.h"

#include <malloc.h>

#include <fstream>
#include <limits>
#include <string>

namespace cuboid_mapping::bench {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

/// VmHWM of /proc/self/status; NaN where there is none.
double highWaterMark_bytes() {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;) {
    double kilobytes = 0.0;
    if (word == "VmHWM:" && status >> kilobytes) return 1024.0 * kilobytes;
  }
  return kUnknown;
}

/// Makes the mark that of the memory which is resident now.
bool resetHighWaterMark() {
  std::ofstream file("/proc/self/clear_refs");
  file << '5' << std::flush;
  return file.good();
}

}  // namespace

PeakMemory::PeakMemory() {
#ifdef __GLIBC__
  malloc_trim(0);
#endif
  start_bytes_ = resetHighWaterMark() ? highWaterMark_bytes() : kUnknown;
}

double PeakMemory::bytes() const { return highWaterMark_bytes() - start_bytes_; }

}  // namespace cuboid_mapping::bench
