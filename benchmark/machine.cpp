// SPDX-License-Identifier: BSD-3-Clause
#include "machine.h"

#include "source_commit.h"  // made by write_commit.cmake

#include <fstream>
#include <thread>

namespace cuboid_mapping::bench {
namespace {

std::string findCpu() {
  std::ifstream file("/proc/cpuinfo");
  std::string line;
  while (std::getline(file, line)) {
    const std::size_t colon = line.find(": ");
    if (line.rfind("model name", 0) == 0 && colon != std::string::npos) {
      return line.substr(colon + 2);
    }
  }
  return "unknown";
}

std::string findCompiler() {
#if defined(__clang__)
  return std::string("clang ") + __clang_version__;
#elif defined(__GNUC__)
  return std::string("gcc ") + __VERSION__;
#else
  return "unknown";
#endif
}

}  // namespace

Machine describeMachine() {
  return {findCpu(), std::thread::hardware_concurrency(), findCompiler(), CUBOID_MAPPING_BUILD_TYPE,
          CUBOID_MAPPING_SOURCE_COMMIT};
}

}  // namespace cuboid_mapping::bench
