// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "options.h"
#include "queries.h"
#include "timing.h"

#include <optional>
#include <string>
#include <vector>

namespace cuboid_mapping::bench {

/// Wall time of the insertion of a cloud, without what is fused behind the last.
struct CloudTimes {
  double p50_ms = 0.0;
  double p99_ms = 0.0;
  double max_ms = 0.0;
  /// Of the clouds: with the next, how cost grows with the map.
  double mean_of_first_third_ms = 0.0;
  double mean_of_last_third_ms = 0.0;
};

/// Quantiles of times.
struct TimeQuantiles {
  double p50_ms = 0.0;
  double p99_ms = 0.0;
  double p999_ms = 0.0;
  double max_ms = 0.0;
};

/// Insertion of single clouds into maps that are filled again and again, all together.
struct CloudSamples {
  std::size_t count = 0;
  TimeQuantiles wall;
  TimeQuantiles cpu;
};

/// What was measured of one map.
struct MapResult {
  std::string name;
  Timing insertion;  ///< With all fusion.
  CloudTimes per_cloud;
  std::optional<CloudSamples> samples;  ///< Of the medians only; see Options::cloud_samples.
  MapFigures figures;
  double access_occupied_s = 0.0;  ///< CPU time of one visit to all occupied cells.
  ByPlace<QueryRates> queries;
  double bytes_peak = 0.0;        ///< Of insertion, with the map: see PeakMemory.
  std::size_t bytes_heap = 0;     ///< Of the map, from the allocator.
  std::size_t bytes_scratch = 0;  ///< Of what only insertion needs, from the allocator.
};

/// How far a peer agrees with cuboid_mapping.
struct PeerAgreement {
  std::string name;
  Agreement voxels;
  ByPlace<AnswerDifferences> answers;
};

struct Comparison {
  /// cuboid_mapping first; each figure that is a time is the median of the repetitions.
  std::vector<MapResult> maps;
  std::vector<std::vector<MapResult>> repetitions;  ///< By repetition, then by map.
  std::vector<std::vector<std::size_t>> orders;     ///< By repetition: indexes of maps, in turn.
  std::vector<PeerAgreement> agreements;
};

/// Fills one map after the other with all scans, then asks all the same; every second repetition takes
/// the maps in reverse order, or each in a random one.
/// @throws std::runtime_error when a map cannot take the scans, Interrupted.
[[nodiscard]] Comparison compareMaps(const Options& options, const std::vector<Scan>& scans);

}  // namespace cuboid_mapping::bench
