// SPDX-License-Identifier: BSD-3-Clause
#include "progress_bar.h"

#include "command_line.h"

#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <iostream>
#include <memory>
#include <optional>
#include <utility>

namespace cuboid_mapping {
namespace {

std::string formatTime(double time_s) {
  const auto seconds = static_cast<long long>(std::ceil(time_s));
  char text[32];
  if (seconds < 3600) {
    std::snprintf(text, sizeof(text), "%lld:%02lld", seconds / 60, seconds % 60);
  } else {
    std::snprintf(text, sizeof(text), "%lld:%02lld:%02lld", seconds / 3600, seconds / 60 % 60,
                  seconds % 60);
  }
  return text;
}

}  // namespace

std::string formatProgress(const Progress& progress, const std::string& unit) {
  constexpr int kWidth = 30;
  const double ratio = static_cast<double>(progress.done) / static_cast<double>(progress.total);
  const int filled = static_cast<int>(ratio * kWidth);
  char counts[80];
  std::snprintf(counts, sizeof(counts), "] %3d %%  %llu of %llu ", static_cast<int>(ratio * 100),
                static_cast<unsigned long long>(progress.done),
                static_cast<unsigned long long>(progress.total));
  std::string line = "[" + std::string(filled, '#') + std::string(kWidth - filled, '.') + counts;
  line += unit;
  if (progress.done == progress.total) {
    line += " in " + formatTime(progress.elapsed_s);
  } else if (progress.done > 0) {
    line += ", " +
            formatTime(progress.elapsed_s * static_cast<double>(progress.total - progress.done) /
                       static_cast<double>(progress.done)) +
            " left";
  }
  return line;
}

ProgressBar::ProgressBar(std::string unit, std::uint64_t total)
    : unit_(std::move(unit)), total_(total), is_on_terminal_(isatty(STDERR_FILENO) == 1) {
  draw();
}

ProgressBar::~ProgressBar() {
  draw();
  if (is_on_terminal_) std::cerr << std::endl;
}

void ProgressBar::update(std::uint64_t done) {
  done_ = done;
  if (Clock::now() - last_drawn_ >= std::chrono::milliseconds(100)) draw();
}

void ProgressBar::draw() {
  if (!is_on_terminal_) return;
  last_drawn_ = Clock::now();
  const std::chrono::duration<double> elapsed = last_drawn_ - start_;
  // The code after the text clears the rest of a longer line.
  std::cerr << '\r' << formatProgress({done_, total_, elapsed.count()}, unit_) << "\033[K"
            << std::flush;
}

ProgressListener showProgress(const std::string& unit) {
  const auto bar = std::make_shared<std::optional<ProgressBar>>();
  return [unit, bar](std::uint64_t done, std::uint64_t total) {
    if (!*bar) bar->emplace(unit, total);
    (*bar)->update(done);
    throwIfInterrupted();
  };
}

}  // namespace cuboid_mapping
