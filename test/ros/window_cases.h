// SPDX-License-Identifier: BSD-3-Clause
// Cases for the parameters of the window, see parameter_cases.h.
#pragma once

#include "ros/parameter_cases.h"

namespace cuboid_mapping_ros {

inline std::vector<Case> windowCases() {
  using P = NodeParameters;
  using cuboid_mapping::OutsideWindow;
  return {
      {"window/frame", "base", [](const P& p) { return p.window.frame_id == "base"; }, {1, true}},
      {"window/size",
       40.0,
       [](const P& p) { return p.window.config.size_m == 40.0 && p.window.config.margin_m == 4.0; },
       {0.0, -1.0, 1.1e6, kNan, "1"}},
      {"window/outside",
       "forget",
       [](const P& p) { return p.window.config.outside == OutsideWindow::kForget; },
       {"", "Keep", 1}},
      {"window/file",
       "/tmp/map.sqlite",
       [](const P& p) { return p.window.file == "/tmp/map.sqlite"; },
       {1, true}},
      {"window/queries",
       "load",
       [](const P& p) { return p.service_limits.outside == QueriesOutside::kLoad; },
       {"", "unknown", 1}},
  };
}

}  // namespace cuboid_mapping_ros
