// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/fusion/fusion_kind.h"

#include "cuboid_mapping/fusion/class_fusion.h"

namespace cuboid_mapping {

const char* toString(FusionKind kind) {
  switch (kind) {
    case FusionKind::kClass: return "class";
    case FusionKind::kGrowth: return "growth";
    case FusionKind::kNone: break;
  }
  return "none";
}

std::optional<FusionKind> parseFusionKind(const std::string& text) {
  for (const FusionKind kind : {FusionKind::kClass, FusionKind::kGrowth, FusionKind::kNone}) {
    if (text == toString(kind)) return kind;
  }
  return std::nullopt;
}

std::unique_ptr<Fusion> makeFusion(const FusionConfig& config, const SensorModel& model) {
  if (config.kind == FusionKind::kGrowth) {
    return std::make_unique<GrowthFusion>(config.growth, config.rtree, model);
  }
  const BrickDivision division =
      config.kind == FusionKind::kNone ? BrickDivision::kVoxels : BrickDivision::kBoxes;
  return std::make_unique<ClassFusion>(division, config.rtree, config.threads);
}

}  // namespace cuboid_mapping
