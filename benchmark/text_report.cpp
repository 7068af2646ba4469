// SPDX-License-Identifier: BSD-3-Clause
#include "machine.h"
#include "report.h"

#include <cmath>
#include <cstdio>

namespace cuboid_mapping::bench {
namespace {

/// One line of the table: a figure of every map, and how many times better than the peers ours is.
struct Line {
  const char* title;
  const char* format;  ///< Of one number.
  double (*value)(const MapResult&);
  bool is_less_better;
};

double toMegabytes(std::size_t bytes) { return 1e-6 * static_cast<double>(bytes); }

const std::vector<Line>& tableLines() {
  using R = const MapResult&;
  static const std::vector<Line> kLines{
      {"insertion, CPU s", "%.3f", [](R r) { return r.insertion.cpu_s; }, true},
      {"  of it ray walk", "%.3f", [](R r) { return r.figures.ray_walk_cpu_s; }, true},
      {"  clouds by columns", "%.0f", [](R r) { return r.figures.clouds_by_columns; }, true},
      {"insertion, wall s", "%.3f", [](R r) { return r.insertion.wall_s; }, true},
      {"cloud, p50 ms", "%.2f", [](R r) { return r.per_cloud.p50_ms; }, true},
      {"cloud, p99 ms", "%.2f", [](R r) { return r.per_cloud.p99_ms; }, true},
      {"cloud, max ms", "%.2f", [](R r) { return r.per_cloud.max_ms; }, true},
      {"cells", "%.0f", [](R r) { return static_cast<double>(r.figures.cells); }, true},
      {"  occupied", "%.0f", [](R r) { return static_cast<double>(r.figures.occupied_cells); },
       true},
      {"leaf nodes", "%.0f", [](R r) { return static_cast<double>(r.figures.leaf_nodes); }, true},
      {"inner nodes", "%.0f", [](R r) { return static_cast<double>(r.figures.inner_nodes); }, true},
      {"own figure, MB", "%.2f", [](R r) { return toMegabytes(r.figures.bytes_own); }, true},
      {"insertion peak, MB", "%.2f", [](R r) { return 1e-6 * r.bytes_peak; }, true},
      {"heap, MB", "%.2f", [](R r) { return toMegabytes(r.bytes_heap); }, true},
      {"scratch, MB", "%.2f", [](R r) { return toMegabytes(r.bytes_scratch); }, true},
      {"visit occupied, ms", "%.3f", [](R r) { return 1e3 * r.access_occupied_s; }, true},
      {"points/s, uniform", "%.3g", [](R r) { return r.queries.uniform.points_per_s; }, false},
      {"points/s, surfaces", "%.3g", [](R r) { return r.queries.near_surface.points_per_s; },
       false},
      {"2 m boxes/s, unif.", "%.3g", [](R r) { return r.queries.uniform.boxes_per_s; }, false},
      {"2 m boxes/s, surf.", "%.3g", [](R r) { return r.queries.near_surface.boxes_per_s; }, false},
      {"30 m rays/s, unif.", "%.3g", [](R r) { return r.queries.uniform.rays_per_s; }, false},
      {"30 m rays/s, surf.", "%.3g", [](R r) { return r.queries.near_surface.rays_per_s; }, false}};
  return kLines;
}

void printLine(const Line& line, const std::vector<MapResult>& maps) {
  std::printf("%-20s", line.title);
  const double own = line.value(maps.front());
  for (const MapResult& map : maps) {
    const double value = line.value(map);
    char number[32] = "-";
    if (std::isfinite(value)) std::snprintf(number, sizeof(number), line.format, value);
    std::printf("%15s", number);
    if (&map == &maps.front()) continue;
    const double ratio = line.is_less_better ? value / own : own / value;
    char gain[32] = "";
    if (std::isfinite(ratio)) std::snprintf(gain, sizeof(gain), "(%.2f)", ratio);
    std::printf("%10s", gain);
  }
  std::printf("\n");
}

void printTable(const std::vector<MapResult>& maps) {
  std::printf("%-20s", "");
  for (const MapResult& map : maps) {
    std::printf(&map == &maps.front() ? "%15s" : "%15s%10s", map.name.c_str(), "(gain)");
  }
  std::printf("\n");
  for (const Line& line : tableLines()) printLine(line, maps);
}

void printSamples(const MapResult& map) {
  if (!map.samples) return;
  const auto print = [](const char* clock, const TimeQuantiles& times) {
    std::printf("  %s ms: p50 %.2f, p99 %.2f, p99.9 %.2f, max %.2f\n", clock, times.p50_ms,
                times.p99_ms, times.p999_ms, times.max_ms);
  };
  std::printf("%zu clouds of %s:\n", map.samples->count, map.name.c_str());
  print("wall", map.samples->wall);
  print("CPU", map.samples->cpu);
}

void printDifferences(const char* place, const AnswerDifferences& answers) {
  std::printf("  answers %-12s points %zu of %zu differ, boxes %zu of %zu, rays %zu of %zu\n",
              place, answers.points.different, answers.points.compared, answers.boxes.different,
              answers.boxes.compared, answers.rays.different, answers.rays.compared);
}

void printAgreement(const PeerAgreement& agreement) {
  std::printf(
      "agreement with %s: %.0f voxels, known mismatch %.0f, class mismatch %.0f, log-odds "
      "difference %.2g\n",
      agreement.name.c_str(), agreement.voxels.voxels, agreement.voxels.known_mismatch,
      agreement.voxels.class_mismatch, agreement.voxels.max_log_odds_difference);
  printDifferences("uniform:", agreement.answers.uniform);
  printDifferences("at surfaces:", agreement.answers.near_surface);
}

}  // namespace

std::size_t countPoints(const std::vector<Scan>& scans) {
  std::size_t points = 0;
  for (const Scan& scan : scans) points += scan.points.size();
  return points;
}

void printReport(const Options& options, const std::vector<Scan>& scans,
                 const Comparison& comparison) {
  const MapConfig& map = options.insertion.map;
  const Machine machine = describeMachine();
  std::printf("dataset     %s: %zu clouds, %zu points\n", options.dataset.c_str(), scans.size(),
              countPoints(scans));
  std::printf("map         %g m voxels, max range %g m, fusion %s, %s, (d, M) = (%d, %d)\n",
              map.resolution_m, options.insertion.max_range_m, toString(map.fusion),
              toString(map.environment), map.rtree.min_branches, map.rtree.max_branches);
  std::printf("run         %d threads, %s, median of %d; commit %s; %s, %u cores; %s, %s\n",
              map.threads,
              options.engine.fuses_every_cloud ? "fused after every cloud"
                                               : "divided when read, at the end",
              options.repeat, machine.commit.c_str(), machine.cpu.c_str(), machine.cores,
              machine.compiler.c_str(), machine.build_type.c_str());
  printTable(comparison.maps);
  for (const MapResult& result : comparison.maps) printSamples(result);
  for (const PeerAgreement& agreement : comparison.agreements) printAgreement(agreement);
}

}  // namespace cuboid_mapping::bench
