// SPDX-License-Identifier: BSD-3-Clause
#include "machine.h"
#include "report.h"

#include <nlohmann/json.hpp>

#include <cmath>
#include <filesystem>

namespace cuboid_mapping::bench {
namespace {

using Json = nlohmann::json;  // with sorted keys; Ubuntu 20.04 has no ordered_json

/// JSON has no infinity and no NaN.
Json toJson(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

/// The name of a data set: that of its folder or file.
std::string nameOf(const std::string& dataset) {
  const std::filesystem::path path = std::filesystem::path(dataset).lexically_normal();
  return (path.has_filename() ? path : path.parent_path()).filename().string();
}

Json toJson(const Options& options) {
  const MapConfig& map = options.insertion.map;
  const EngineOptions& engine = options.engine;
  return {{"resolution_m", map.resolution_m},
          {"max_range_m", toJson(options.insertion.max_range_m)},
          {"fusion", toString(map.fusion)},
          {"environment", toString(map.environment)},
          {"branching", map.rtree.max_branches},
          {"threads", map.threads},
          {"fuse_every_cloud", engine.fuses_every_cloud},
          {"laps", options.laps},
          {"point_step", options.point_step},
          {"every", options.every},
          {"repeat", options.repeat},
          {"shuffle", options.shuffle},
          {"query_time_s", options.query_time_s}};
}

Json toJson(const Machine& machine) {
  return {{"cpu", machine.cpu},
          {"cores", machine.cores},
          {"compiler", machine.compiler},
          {"build_type", machine.build_type},
          {"commit", machine.commit}};
}

/// One rate at both places.
Json toJson(const ByPlace<QueryRates>& queries, double QueryRates::*rate) {
  return {{"uniform", toJson(queries.uniform.*rate)},
          {"near_surface", toJson(queries.near_surface.*rate)}};
}

/// What differs from one repetition to the next.
Json timesToJson(const MapResult& result) {
  return {{"insert_s", result.insertion.wall_s},
          {"insert_cpu_s", result.insertion.cpu_s},
          {"ray_walk_cpu_s", toJson(result.figures.ray_walk_cpu_s)},
          {"per_cloud_ms",
           {{"p50", result.per_cloud.p50_ms},
            {"p99", result.per_cloud.p99_ms},
            {"max", result.per_cloud.max_ms},
            {"mean_of_first_third", result.per_cloud.mean_of_first_third_ms},
            {"mean_of_last_third", result.per_cloud.mean_of_last_third_ms}}},
          {"access_occupied_s", result.access_occupied_s},
          {"point_queries_per_s", toJson(result.queries, &QueryRates::points_per_s)},
          {"box_queries_per_s", toJson(result.queries, &QueryRates::boxes_per_s)},
          {"ray_queries_per_s", toJson(result.queries, &QueryRates::rays_per_s)}};
}

Json toJson(const TimeQuantiles& times) {
  return {{"p50", times.p50_ms},
          {"p99", times.p99_ms},
          {"p99_9", times.p999_ms},
          {"max", times.max_ms}};
}

Json toJson(const std::optional<CloudSamples>& samples) {
  if (!samples) return nullptr;
  return {{"count", samples->count},
          {"wall_ms", toJson(samples->wall)},
          {"cpu_ms", toJson(samples->cpu)}};
}

Json toJson(const MapResult& result) {
  const MapFigures& figures = result.figures;
  Json json = timesToJson(result);
  json["cloud_samples"] = toJson(result.samples);
  json.update({{"clouds_by_columns", toJson(figures.clouds_by_columns)},
               {"cells", figures.cells},
               {"occupied_cells", figures.occupied_cells},
               {"free_cells", figures.free_cells},
               {"leaf_nodes", figures.leaf_nodes},
               {"inner_nodes", figures.inner_nodes},
               {"bytes_own", figures.bytes_own},
               {"bytes_peak", toJson(result.bytes_peak)},
               {"bytes_heap", result.bytes_heap},
               {"bytes_scratch", result.bytes_scratch}});
  return json;
}

Json toJson(const Differences& differences) {
  return {{"compared", differences.compared}, {"different", differences.different}};
}

/// One kind of query at both places.
Json toJson(const ByPlace<AnswerDifferences>& answers, Differences AnswerDifferences::*kind) {
  return {{"uniform", toJson(answers.uniform.*kind)},
          {"near_surface", toJson(answers.near_surface.*kind)}};
}

Json toJson(const PeerAgreement& agreement) {
  return {{"voxels", agreement.voxels.voxels},
          {"known_mismatch", agreement.voxels.known_mismatch},
          {"class_mismatch", agreement.voxels.class_mismatch},
          {"max_log_odds_difference", agreement.voxels.max_log_odds_difference},
          {"point_queries", toJson(agreement.answers, &AnswerDifferences::points)},
          {"box_queries", toJson(agreement.answers, &AnswerDifferences::boxes)},
          {"ray_queries", toJson(agreement.answers, &AnswerDifferences::rays)}};
}

}  // namespace

std::string makeJsonReport(const Options& options, const std::vector<Scan>& scans,
                           const Comparison& comparison) {
  Json report;
  report["dataset"] = nameOf(options.dataset);
  report["clouds"] = scans.size();
  report["points"] = countPoints(scans);
  report.update(toJson(options));
  report["machine"] = toJson(describeMachine());
  for (const MapResult& result : comparison.maps) report[result.name] = toJson(result);
  for (const std::vector<MapResult>& results : comparison.repetitions) {
    for (const MapResult& result : results) {
      report[result.name]["repetitions"].push_back(timesToJson(result));
    }
  }
  for (const std::vector<std::size_t>& order : comparison.orders) {
    Json names;
    for (const std::size_t map : order) names.push_back(comparison.maps[map].name);
    report["orders"].push_back(names);
  }
  report["agreement"] = Json::object();
  for (const PeerAgreement& agreement : comparison.agreements) {
    report["agreement"][agreement.name] = toJson(agreement);
  }
  return report.dump(2) + '\n';
}

}  // namespace cuboid_mapping::bench
