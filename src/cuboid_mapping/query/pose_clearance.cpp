// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/pose_clearance.h"

namespace cuboid_mapping {

PoseClearance::PoseClearance(const CuboidMap& map, const Body& body, UnknownPolicy policy,
                             Budget& budget, const CellBox& region, double clearance_m) {
  const int last = clearance_m > 0.0 ? kLevels : 0;
  for (int level = 0; level <= last; ++level) {
    const double margin_m = clearance_m * level / kLevels;
    probes_[static_cast<std::size_t>(level)] = std::make_unique<BodyProbe>(
        map, body, policy, budget, region, Eigen::Vector3d(margin_m, margin_m, 0.0));
  }
}

int PoseClearance::levelAt(const Eigen::Isometry3d& T_map_body) {
  int level = last();
  while (level > 0 && probes_[static_cast<std::size_t>(level)]->findContact(T_map_body)) --level;
  return level;
}

}  // namespace cuboid_mapping
