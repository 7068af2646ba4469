// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/middleware/free_memory.h"

#include <cstdlib>  // Defines __GLIBC__.

#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace cuboid_mapping_ros {

void giveMemoryBack() {
#ifdef __GLIBC__
  malloc_trim(0);
#endif
}

}  // namespace cuboid_mapping_ros
