// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_adapter.h"
#include "peers.h"
#include "timing.h"

#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace cuboid_mapping::bench {

/// The command line of compare_maps.
struct Options {
  std::string dataset;
  std::string cloud_topic;  ///< Of a bag; empty: the only one that there is.
  std::string map_frame = "map";
  InsertionConfig insertion;
  EngineOptions engine;
  std::size_t clouds = std::numeric_limits<std::size_t>::max();  ///< At most so many.
  int laps = 1;                                                  ///< See repeatElsewhere().
  int point_step = 1;                                            ///< See DatasetChoice.
  int every = 1;                                                 ///< See DatasetChoice.
  int repeat = 1;
  int shuffle = 0;  ///< Seed of the order of maps; 0: as made, and every second time reversed.
  std::size_t cloud_samples = 0;          ///< Clouds to time beside the repetitions, at least.
  double query_time_s = kTimedQueries_s;  ///< CPU time of the timed queries of a kind, at least.
  std::vector<Peer> peers;                ///< All with a maker.
  std::string json_file;                  ///< Empty: none.
};

/// @return Nothing when the program shall go on; else its exit status, all being said.
/// @throws std::runtime_error for options that cannot go together.
[[nodiscard]] std::optional<int> parseOptions(int argc, char** argv, Options& options);

}  // namespace cuboid_mapping::bench
