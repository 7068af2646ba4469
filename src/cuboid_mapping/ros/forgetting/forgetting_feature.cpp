// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/forgetting/forgetting_feature.h"

#include "cuboid_mapping/ros/parameters/parameter_table.h"

namespace cuboid_mapping_ros {
namespace {

using P = NodeParameters;
using S = SourceParameters;

}  // namespace

std::vector<ParameterDeclaration> ForgettingFeature::declare() {
  return {
      {"forget_after", "s", number(&S::forget_after_s, 0.0, 1e6),
       "Voxels that no cloud has observed for this long become unknown. Time counts by stamps, "
       "per block of 8 x 8 x 8 voxels. Each source can have its own time; a block stays "
       "while one source remembers it. Locked boxes stay, and so do blocks that no cloud has "
       "observed, such as those of files and edits. 0: never."},
      {"forget", "",
       choice<Forget>(&P::forget, {{"all", Forget::kAll},
                                   {"occupied", Forget::kOccupied},
                                   {"free", Forget::kFree},
                                   {"seen_once", Forget::kSeenOnce}}),
       "What forget_after forgets. all: obstacles and free space. occupied: obstacles only. free: "
       "free space only. seen_once: nothing becomes unknown; voxels keep their class, as if seen "
       "once, and the next cloud can change it."},
  };
}

}  // namespace cuboid_mapping_ros
