// SPDX-License-Identifier: BSD-3-Clause
#include <cuboid_mapping/map/mapper.h>
#include <cuboid_mapping/query/box_query.h>
#include <iostream>

int main() {
  using namespace cuboid_mapping;
  MapperConfig config;
  config.map.resolution_m = 0.1;
  Mapper mapper(config);  // Throws std::invalid_argument with all errors.
  const Eigen::Isometry3d T_map_sensor(Eigen::Translation3d(0.0, 0.0, 1.0));
  const std::vector<Eigen::Vector3f> points_sensor = {{5.05F, 0.05F, 0.05F}, {5.05F, 0.15F, 0.05F}};
  mapper.integrate(makeScan(T_map_sensor, T_map_sensor.translation(), points_sensor));
  for (const double x : {4.0, 5.0, 6.0}) {
    const MetricBox box{{x, 0.0, 1.0}, {x + 0.1, 0.1, 1.1}};
    const auto answer = queryBox(mapper.map(), box, Budget::unlimited());
    if (answer.isFound()) std::cout << x << " m: " << toString(answer->occupancy()) << '\n';
  }
}
