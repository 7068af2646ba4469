// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/middleware/free_memory.h"

#include <gtest/gtest.h>

#include <unistd.h>
#include <fstream>
#include <memory>
#include <vector>

namespace cuboid_mapping_ros {
namespace {

double residentMegabytes() {
  std::ifstream statm("/proc/self/statm");
  double all = 0.0;
  double resident = 0.0;
  statm >> all >> resident;
  return 1e-6 * resident * static_cast<double>(::sysconf(_SC_PAGESIZE));
}

TEST(FreeMemory, goesBackToTheSystemAlsoBelowObjectsThatLiveOn) {
#if !defined(__GLIBC__) || defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "another allocator";
#endif
  std::vector<std::unique_ptr<std::vector<char>>> blocks(50000);
  for (auto& block : blocks) block = std::make_unique<std::vector<char>>(2000, 'x');
  const auto last = std::move(blocks.back());
  blocks.clear();
  const double before = residentMegabytes();
  giveMemoryBack();
  EXPECT_LT(residentMegabytes(), before - 50.0);
}

}  // namespace
}  // namespace cuboid_mapping_ros
