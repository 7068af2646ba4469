// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/geometry/isometry.h"

namespace cuboid_mapping {

template <>
const char EigenAlignment<alignof(Eigen::Isometry3d)>::kIsThatOfTheLibrary = 0;

}  // namespace cuboid_mapping
