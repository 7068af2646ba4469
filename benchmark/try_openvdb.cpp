// SPDX-License-Identifier: BSD-3-Clause
// Whether the installed OpenVDB compiles and links; CMake tries it.
#define TBB_PREVIEW_GLOBAL_CONTROL 1  // for TBB before 2021
#include <openvdb/math/DDA.h>
#include <openvdb/openvdb.h>
#include <tbb/global_control.h>

int main() {
  const tbb::global_control control(tbb::global_control::max_allowed_parallelism, 1);
  openvdb::initialize();
  return 0;
}
