// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/query/body_motion.h"
#include "cuboid_mapping/query/body_probe.h"

#include <array>
#include <memory>

namespace cuboid_mapping {

/// The room around a body along its x and y, in levels: at level 0 it fits, at each of the next ones with a quarter of
/// the clearance more on all sides, at the last one with all of it.
class PoseClearance {
 public:
  static constexpr int kLevels = 4;

  /// @param body, budget  Must outlive this object. @param clearance_m  0: level 0 only.
  PoseClearance(const CuboidMap& map, const Body& body, UnknownPolicy policy, Budget& budget,
                const CellBox& region, double clearance_m) {
    const int last = clearance_m > 0.0 ? kLevels : 0;
    for (int level = 0; level <= last; ++level) {
      const double margin_m = clearance_m * level / kLevels;
      probes_[static_cast<std::size_t>(level)] = std::make_unique<BodyProbe>(
          map, body, policy, budget, region, Eigen::Vector3d(margin_m, margin_m, 0.0));
    }
  }

  /// The probe of level 0.
  [[nodiscard]] BodyProbe& body() { return *probes_[0]; }
  /// The last level; 0 without a clearance.
  [[nodiscard]] int last() const { return probes_[kLevels] ? kLevels : 0; }
  /// The greatest level at which the body fits. @pre It fits.
  [[nodiscard]] int levelAt(const Eigen::Isometry3d& T_map_body) {
    int level = last();
    while (level > 0 && probes_[static_cast<std::size_t>(level)]->findContact(T_map_body)) --level;
    return level;
  }
  /// Whether a motion is free at a level.
  [[nodiscard]] bool isFreeAt(int level, const BodyMotion& motion) {
    return isFree(*probes_[static_cast<std::size_t>(level)], motion);
  }

 private:
  std::array<std::unique_ptr<BodyProbe>, kLevels + 1> probes_;  ///< By level.
};

}  // namespace cuboid_mapping
