// SPDX-License-Identifier: BSD-3-Clause
#include "fuzz_target.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <vector>

namespace cuboid_mapping {
namespace {

using Bytes = std::vector<std::uint8_t>;

std::vector<std::filesystem::path> listFiles(const char* folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

Bytes readBytes(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return Bytes(std::istreambuf_iterator<char>(in), {});
}

}  // namespace

void replayCorpus(const char* folder, int (*work)(const std::uint8_t* data, std::size_t size)) {
  const auto files = listFiles(folder);
  ASSERT_GE(files.size(), 10U) << folder;
  std::mt19937 random(1);
  for (const auto& file : files) {
    SCOPED_TRACE(file.string());
    const Bytes bytes = readBytes(file);
    EXPECT_EQ(work(bytes.data(), bytes.size()), 0);
    for (int i = 0; i < 10 && !bytes.empty(); ++i) {
      Bytes changed = bytes;
      for (int k = 0; k < 3; ++k) {
        changed[random() % changed.size()] = static_cast<std::uint8_t>(random());
      }
      EXPECT_EQ(work(changed.data(), changed.size()), 0);
    }
  }
}

}  // namespace cuboid_mapping
