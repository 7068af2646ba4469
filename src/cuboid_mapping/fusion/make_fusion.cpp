// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/fusion/make_fusion.h"

#include "cuboid_mapping/fusion/class_fusion.h"
#include "cuboid_mapping/fusion/growth_fusion.h"

namespace cuboid_mapping {

std::unique_ptr<Fusion> makeFusion(const FusionConfig& config, const SensorModel& model) {
  if (config.kind == FusionKind::kGrowth) {
    return std::make_unique<GrowthFusion>(config.growth, config.rtree, model);
  }
  const BrickDivision division =
      config.kind == FusionKind::kNone ? BrickDivision::kVoxels : BrickDivision::kBoxes;
  return std::make_unique<ClassFusion>(division, config.rtree, config.threads);
}

}  // namespace cuboid_mapping
