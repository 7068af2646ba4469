// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/progress_listener.h"

#include <chrono>
#include <cstdint>
#include <string>

namespace cuboid_mapping {

/// Progress of a program.
struct Progress {
  std::uint64_t done = 0;
  std::uint64_t total = 0;  ///< > 0
  double elapsed_s = 0.0;
};

/// One line of text: bar, percentage, counts, and a time as minutes:seconds or
/// hours:minutes:seconds.
///
/// Cases:
///   - nothing done: no time;
///   - all done: the time it took;
///   - else: the time left at the speed so far.
///
/// @param unit  The counted unit: "clouds".
[[nodiscard]] std::string formatProgress(const Progress& progress, const std::string& unit);

/// A progress bar on stderr, if that is a terminal; else it writes nothing.
///
/// The line is redrawn at most ten times a second. The destructor ends it, so that later output
/// begins on its own line.
class ProgressBar {
 public:
  /// @param unit  The counted unit: "clouds". @param total  Their number, > 0.
  ProgressBar(std::string unit, std::uint64_t total);
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  /// @param done  Finished number of the total.
  void update(std::uint64_t done);

 private:
  using Clock = std::chrono::steady_clock;

  void draw();

  std::string unit_;
  std::uint64_t total_;
  std::uint64_t done_ = 0;
  bool is_on_terminal_;
  Clock::time_point start_ = Clock::now();
  Clock::time_point last_drawn_ = start_;
};

/// Draws a ProgressBar from its first call on, until it and its copies are
/// destroyed. It throws Interrupted after Ctrl-C, to end the work; see throwIfInterrupted().
/// @param unit  The counted unit: "rows".
[[nodiscard]] ProgressListener showProgress(const std::string& unit);

}  // namespace cuboid_mapping
