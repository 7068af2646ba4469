// SPDX-License-Identifier: BSD-3-Clause
#include "soak.h"

#include "scenes.h"
#include "ways.h"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <random>

namespace cuboid_mapping_rviz::bench {
namespace {

using namespace cuboid_mapping;
using Clock = std::chrono::steady_clock;

double residentMegabytes() {
  std::size_t pages = 0;
  std::size_t resident_pages = 0;
  std::ifstream("/proc/self/statm") >> pages >> resident_pages;
  return 1e-6 * static_cast<double>(resident_pages) * static_cast<double>(sysconf(_SC_PAGESIZE));
}

/// A block of 16 x 16 x 16 voxels somewhere on the ground appears, or goes.
ChangeSet changeSomething(CuboidMap& map, std::mt19937& random) {
  const auto place = [&] { return static_cast<std::int32_t>(random() % 40) * 16 - 320; };
  const Cell min{place(), place(), 16};
  const CellBox box{min, min + Cell{16, 16, 16}};
  std::vector<UniformBox> content;
  if (random() % 2 == 0) content.push_back({box, 1.0F});
  ChangeSet changes = map.replace(box, content);
  return changes;
}

double maxOf(const std::vector<double>& values, std::size_t first, std::size_t end) {
  return *std::max_element(values.begin() + static_cast<std::ptrdiff_t>(first),
                           values.begin() + static_cast<std::ptrdiff_t>(end));
}

}  // namespace

int followUpdates(double minutes) {
  constexpr std::chrono::milliseconds kPeriod{100};
  test::RvizWindow window({640, 360});
  CuboidMap map = makeGround(1e5);
  DisplayWay way;
  window.look(100.0, 0.7, 0.7);
  way.load(window, map);
  window.updateUntil([&] { return way.isDrawn(window); });
  std::printf(
      "| minute | changes | resident (MB) | vertices (MB) | uploaded (MB) "
      "|\n|---|---|---|---|---|\n");
  std::mt19937 random(1);
  std::vector<double> resident_mb;
  std::size_t num_changes = 0;
  const Clock::time_point start = Clock::now();
  const auto num_minutes = static_cast<std::size_t>(minutes);
  while (resident_mb.size() < num_minutes) {
    const Clock::time_point next = Clock::now() + kPeriod;
    way.send(map, changeSomething(map, random));
    ++num_changes;
    do {
      window.update();
    } while (Clock::now() < next);
    if (Clock::now() - start < std::chrono::minutes(resident_mb.size() + 1)) continue;
    resident_mb.push_back(residentMegabytes());
    std::printf("| %zu | %zu | %.1f | %.1f | %.0f |\n", resident_mb.size(), num_changes,
                resident_mb.back(), 1e-6 * way.numBytes(), 1e-6 * way.numUploadedBytes());
    std::fflush(stdout);
  }
  const std::size_t third = num_minutes / 3;
  if (third == 0) return 0;
  const double before_mb = maxOf(resident_mb, third, 2 * third);
  const double after_mb = maxOf(resident_mb, 2 * third, num_minutes);
  std::printf("second third: %.1f MB, last third: %.1f MB\n", before_mb, after_mb);
  return after_mb <= 1.05 * before_mb ? 0 : 1;
}

}  // namespace cuboid_mapping_rviz::bench
