// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/geometry/isometry.h"
#include "cuboid_mapping/geometry/standard_containers.h"

namespace cuboid_mapping {

template <>
const char EigenAlignment<alignof(Eigen::Isometry3d)>::kIsThatOfTheLibrary = 0;

template <>
const char StandardVector<sizeof(std::vector<char>)>::kIsThatOfTheLibrary = 0;

}  // namespace cuboid_mapping
