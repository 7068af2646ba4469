// SPDX-License-Identifier: BSD-3-Clause
// Cases for the parameters of kept clouds, see parameter_cases.h.
#pragma once

#include "ros/parameter_cases.h"

namespace cuboid_mapping_ros {

inline std::vector<Case> keepCases() {
  using P = NodeParameters;
  return {
      {"keep_clouds/memory",
       200,
       [](const P& p) { return p.keep.memory_mb == 200; },
       {-1, 1000001, 1.5, "1"}},
      {"keep_clouds/body_frame",
       "base",
       [](const P& p) { return p.keep.body_frame == "base"; },
       {1, true}},
  };
}

}  // namespace cuboid_mapping_ros
