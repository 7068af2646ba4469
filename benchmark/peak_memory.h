// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace cuboid_mapping::bench {

/// The greatest memory of this process from now on, beyond what it has now.
///
/// Returns free memory of the heap to the system first, so that work cannot hide in it. Takes the high
/// water mark of Linux, which also knows what was freed again at once.
class PeakMemory {
 public:
  PeakMemory();
  /// NaN where Linux does not let the mark be set back (CONFIG_PROC_PAGE_MONITOR).
  [[nodiscard]] double bytes() const;

 private:
  double start_bytes_;
};

}  // namespace cuboid_mapping::bench
