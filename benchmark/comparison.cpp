// SPDX-License-Identifier: BSD-3-Clause
#include "comparison.h"

#include "command_line.h"
#include "peak_memory.h"
#include "progress_bar.h"

#include <algorithm>
#include <numeric>
#include <random>
#include <stdexcept>

namespace cuboid_mapping::bench {
namespace {

/// The maps of one repetition.
struct Maps {
  std::unique_ptr<CuboidAdapter> own;
  std::vector<std::unique_ptr<PeerAdapter>> peers;

  /// Own first.
  [[nodiscard]] std::vector<MapAdapter*> all() const {
    std::vector<MapAdapter*> maps{own.get()};
    for (const auto& peer : peers) maps.push_back(peer.get());
    return maps;
  }
};

/// Answers to all queries, in the order of Maps::all().
using AllAnswers = std::vector<ByPlace<QueryAnswers>>;

std::unique_ptr<CuboidAdapter> makeOwnMap(const Options& options) {
  return std::make_unique<CuboidAdapter>(options.insertion, options.engine);
}

Maps makeMaps(const Options& options) {
  Maps maps;
  maps.own = makeOwnMap(options);
  for (const Peer& peer : options.peers) maps.peers.push_back(peer.make(options.insertion));
  return maps;
}

void checkScans(const Maps& maps, const std::vector<Scan>& scans) {
  const bool has_anchor = std::any_of(scans.begin(), scans.end(),
                                      [](const Scan& scan) { return !scan.anchor_map.isZero(); });
  for (const auto& peer : maps.peers) {
    if (has_anchor && !peer->takesAnchors()) {
      throw std::runtime_error(
          peer->name() +
          " is not exact for scans more than 512 m from the origin: exclude it "
          "with --peers");
    }
  }
}

/// @param clouds_ms  In the order of the clouds; at least one.
CloudTimes summarize(const std::vector<double>& clouds_ms) {
  const std::size_t third = std::max<std::size_t>(1, clouds_ms.size() / 3);
  const auto length = static_cast<std::ptrdiff_t>(third);
  const auto mean = [third](auto first, auto last) {
    return std::accumulate(first, last, 0.0) / static_cast<double>(third);
  };
  return {quantile(clouds_ms, 0.5), quantile(clouds_ms, 0.99), quantile(clouds_ms, 1.0),
          mean(clouds_ms.begin(), clouds_ms.begin() + length),
          mean(clouds_ms.end() - length, clouds_ms.end())};
}

/// Indexes of the maps in the order of one repetition: what a map finds in caches and heap depends on
/// the one before.
/// @param seed  Of a random order; 0: every second repetition has the reverse one.
std::vector<std::size_t> makeOrder(std::size_t num_maps, std::size_t repetition, int seed) {
  std::vector<std::size_t> order(num_maps);
  std::iota(order.begin(), order.end(), std::size_t{0});
  if (seed > 0) {
    std::seed_seq seeds{static_cast<std::size_t>(seed), repetition};
    std::shuffle(order.begin(), order.end(), std::mt19937(seeds));
  } else if (repetition % 2 == 1) {
    std::reverse(order.begin(), order.end());
  }
  return order;
}

MapResult insertInto(MapAdapter& map, const std::vector<Scan>& scans, std::size_t& steps,
                     ProgressBar& progress) {
  MapResult result;
  result.name = map.name();
  std::vector<double> per_cloud_ms;
  const PeakMemory peak;
  for (const Scan& scan : scans) {
    throwIfInterrupted();
    const Timing timing = timeOf([&] { map.insert(scan); });
    result.insertion += timing;
    per_cloud_ms.push_back(1e3 * timing.wall_s);
    progress.update(++steps);
  }
  result.insertion += timeOf([&] { map.finish(); });
  result.bytes_peak = peak.bytes();
  result.per_cloud = summarize(per_cloud_ms);
  return result;
}

TimeQuantiles quantilesOf(const std::vector<double>& times_ms) {
  return {quantile(times_ms, 0.5), quantile(times_ms, 0.99), quantile(times_ms, 0.999),
          quantile(times_ms, 1.0)};
}

/// Fills maps with all scans until enough clouds were timed.
/// @param make_map  () -> std::unique_ptr<MapAdapter>, empty.
template <typename MakeMapT>
CloudSamples sampleClouds(const MakeMapT& make_map, const std::vector<Scan>& scans,
                          std::size_t min_count) {
  std::vector<double> wall_ms;
  std::vector<double> cpu_ms;
  ProgressBar progress("clouds sampled", min_count);
  while (wall_ms.size() < min_count) {
    const auto map = make_map();
    for (const Scan& scan : scans) {
      throwIfInterrupted();
      const Timing timing = timeOf([&] { map->insert(scan); });
      wall_ms.push_back(1e3 * timing.wall_s);
      cpu_ms.push_back(1e3 * timing.cpu_s);
    }
    progress.update(std::min(min_count, wall_ms.size()));
  }
  return {wall_ms.size(), quantilesOf(wall_ms), quantilesOf(cpu_ms)};
}

void addSamples(const Options& options, const std::vector<Scan>& scans,
                std::vector<MapResult>& results) {
  if (options.cloud_samples == 0) return;
  results[0].samples =
      sampleClouds([&options] { return makeOwnMap(options); }, scans, options.cloud_samples);
  for (std::size_t i = 0; i < options.peers.size(); ++i) {
    results[i + 1].samples =
        sampleClouds([&options, i] { return options.peers[i].make(options.insertion); }, scans,
                     options.cloud_samples);
  }
}

/// One map after the other takes all clouds, as a robot with that map would: from cloud to cloud,
/// the peers would find the processor's caches as the one before has left them.
/// @param steps  Of the progress bar so far.
std::vector<MapResult> insertScans(const Maps& maps, const std::vector<std::size_t>& order,
                                   const std::vector<Scan>& scans, std::size_t& steps,
                                   ProgressBar& progress) {
  std::vector<MapResult> results(order.size());
  for (const std::size_t i : order) results[i] = insertInto(*maps.all()[i], scans, steps, progress);
  return results;
}

/// Adds figures of the filled maps to the results.
AllAnswers measureAccess(const Maps& maps, const std::vector<std::size_t>& order,
                         const ByPlace<QuerySet>& queries, double query_time_s,
                         std::vector<MapResult>& results) {
  AllAnswers answers(order.size());
  for (const std::size_t i : order) {
    throwIfInterrupted();
    const MapAdapter& map = *maps.all()[i];
    results[i].figures = map.figures();
    results[i].access_occupied_s =
        cpuTimeOfOne_s([&map] { return map.visitOccupied(); }, query_time_s);
    QueryRun uniform = askQueries(map, queries.uniform, query_time_s);
    QueryRun near_surface = askQueries(map, queries.near_surface, query_time_s);
    results[i].queries = {uniform.rates, near_surface.rates};
    answers[i] = {std::move(uniform.answers), std::move(near_surface.answers)};
  }
  return answers;
}

std::vector<PeerAgreement> findAgreements(const Maps& maps, const AllAnswers& answers) {
  const CuboidMap& own = maps.own->map();
  const double resolution_m = own.grid().resolution();
  std::vector<PeerAgreement> agreements;
  for (std::size_t i = 0; i < maps.peers.size(); ++i) {
    const ByPlace<QueryAnswers>& peer = answers[i + 1];
    agreements.push_back(
        {maps.peers[i]->name(),
         maps.peers[i]->compareWith(own),
         {compareAnswers(answers[0].uniform, peer.uniform, resolution_m),
          compareAnswers(answers[0].near_surface, peer.near_surface, resolution_m)}});
  }
  return agreements;
}

/// Frees the maps and sees what comes back.
void measureHeap(const Maps& maps, std::vector<MapResult>& results) {
  const std::vector<MapAdapter*> adapters = maps.all();
  for (std::size_t i = 0; i < adapters.size(); ++i) {
    const std::size_t before = heapBytes();
    adapters[i]->dropScratch();
    const std::size_t between = heapBytes();
    adapters[i]->dropMap();
    results[i].bytes_scratch = before - between;
    results[i].bytes_heap = between - heapBytes();
  }
}

/// A figure of a result, as an lvalue.
using FigureOf = double& (*)(MapResult&);

/// Every figure that is a time or a rate.
const std::vector<FigureOf>& measuredFigures() {
  static const std::vector<FigureOf> kFigures{
      [](MapResult& r) -> double& { return r.insertion.cpu_s; },
      [](MapResult& r) -> double& { return r.insertion.wall_s; },
      [](MapResult& r) -> double& { return r.per_cloud.p50_ms; },
      [](MapResult& r) -> double& { return r.per_cloud.p99_ms; },
      [](MapResult& r) -> double& { return r.per_cloud.max_ms; },
      [](MapResult& r) -> double& { return r.per_cloud.mean_of_first_third_ms; },
      [](MapResult& r) -> double& { return r.per_cloud.mean_of_last_third_ms; },
      [](MapResult& r) -> double& { return r.figures.ray_walk_cpu_s; },
      [](MapResult& r) -> double& { return r.access_occupied_s; },
      [](MapResult& r) -> double& { return r.bytes_peak; },
      [](MapResult& r) -> double& { return r.queries.uniform.points_per_s; },
      [](MapResult& r) -> double& { return r.queries.uniform.boxes_per_s; },
      [](MapResult& r) -> double& { return r.queries.uniform.rays_per_s; },
      [](MapResult& r) -> double& { return r.queries.near_surface.points_per_s; },
      [](MapResult& r) -> double& { return r.queries.near_surface.boxes_per_s; },
      [](MapResult& r) -> double& { return r.queries.near_surface.rays_per_s; }};
  return kFigures;
}

/// The last repetition with medians in place of what was measured.
/// @param runs  By repetition, then by map.
std::vector<MapResult> takeMedians(std::vector<std::vector<MapResult>>& runs) {
  std::vector<MapResult> results = runs.back();
  for (std::size_t map = 0; map < results.size(); ++map) {
    for (const FigureOf figure : measuredFigures()) {
      std::vector<double> values;
      values.reserve(runs.size());
      for (std::vector<MapResult>& run : runs) values.push_back(figure(run[map]));
      figure(results[map]) = median(values);
    }
  }
  return results;
}

}  // namespace

Comparison compareMaps(const Options& options, const std::vector<Scan>& scans) {
  checkScans(makeMaps(options), scans);
  Comparison comparison;
  std::optional<ByPlace<QuerySet>> queries;
  std::vector<std::vector<MapResult>>& runs = comparison.repetitions;
  const auto repeat = static_cast<std::size_t>(options.repeat);
  const std::size_t num_maps = 1 + options.peers.size();
  ProgressBar progress("clouds", repeat * scans.size() * num_maps);
  std::size_t steps = 0;
  while (runs.size() < repeat) {
    const Maps maps = makeMaps(options);
    const std::vector<std::size_t> order = makeOrder(num_maps, runs.size(), options.shuffle);
    comparison.orders.push_back(order);
    runs.push_back(insertScans(maps, order, scans, steps, progress));
    if (!queries) queries = makeQueries(maps.own->map(), scans);
    const AllAnswers answers =
        measureAccess(maps, order, *queries, options.query_time_s, runs.back());
    maps.own->measureWalk(scans, runs.back().front().figures);
    if (runs.size() < repeat) continue;
    comparison.agreements = findAgreements(maps, answers);
    measureHeap(maps, runs.back());
  }
  comparison.maps = takeMedians(runs);
  addSamples(options, scans, comparison.maps);
  return comparison;
}

}  // namespace cuboid_mapping::bench
