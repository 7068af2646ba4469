// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/fusion/fusion_kind.h"

namespace cuboid_mapping {

const char* toString(FusionKind kind) {
  switch (kind) {
    case FusionKind::kClass: return "class";
    case FusionKind::kGrowth: return "growth";
    case FusionKind::kNone: break;
  }
  return "none";
}

const char* toString(FusionTime time) {
  return time == FusionTime::kEveryCloud ? "every_cloud" : "when_read";
}

std::optional<FusionKind> parseFusionKind(const std::string& text) {
  for (const FusionKind kind : {FusionKind::kClass, FusionKind::kGrowth, FusionKind::kNone}) {
    if (text == toString(kind)) return kind;
  }
  return std::nullopt;
}

}  // namespace cuboid_mapping
