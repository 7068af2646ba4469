// SPDX-License-Identifier: BSD-3-Clause
// Prints the solids of the simulated building that do not move, with the door open, for campaign/planner.
#include "simulation/world.h"

#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <variant>

namespace cuboid_mapping {
namespace {

/// Lowest and highest z, then "rect" with centre, half edges and angle about z, or "circle" with centre and radius.
struct Printer {
  void operator()(const MetricBox& box) const {
    (*this)(RotatedBox{0.5 * (box.min_m + box.max_m), 0.5 * (box.max_m - box.min_m), 0.0});
  }
  void operator()(const RotatedBox& box) const {
    std::cout << box.center_m.z() - box.half_size_m.z() << ' '
              << box.center_m.z() + box.half_size_m.z() << " rect " << box.center_m.x() << ' '
              << box.center_m.y() << ' ' << box.half_size_m.x() << ' ' << box.half_size_m.y() << ' '
              << box.yaw_rad << '\n';
  }
  void operator()(const Cylinder& cylinder) const {
    std::cout << cylinder.bottom_m << ' ' << cylinder.top_m << " circle " << cylinder.axis_m.x()
              << ' ' << cylinder.axis_m.y() << ' ' << cylinder.radius_m << '\n';
  }
};

}  // namespace
}  // namespace cuboid_mapping

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: true_solids SEED\n";
    return 1;
  }
  const auto seed = static_cast<std::uint64_t>(std::strtoull(argv[1], nullptr, 10));
  const cuboid_mapping::World world(seed, cuboid_mapping::DoorMotion::kOpen);
  auto solids = world.computeSolids(0.0);
  solids.pop_back();  // The walker.
  for (const auto& solid : solids) std::visit(cuboid_mapping::Printer{}, solid.shape);
  return 0;
}
