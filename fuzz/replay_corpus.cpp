// SPDX-License-Identifier: BSD-3-Clause
// Runs a fuzzer on the files of its corpus, and on each of them again with some changed bytes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {

using Bytes = std::vector<std::uint8_t>;

std::vector<std::filesystem::path> listCorpus() {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(FUZZ_CORPUS)) {
    files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

Bytes readBytes(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return Bytes(std::istreambuf_iterator<char>(in), {});
}

TEST(Corpus, isWorkedOnWithoutHarm) {
  const auto files = listCorpus();
  ASSERT_GE(files.size(), 10U) << FUZZ_CORPUS;
  std::mt19937 random(1);
  for (const auto& file : files) {
    SCOPED_TRACE(file.string());
    const Bytes bytes = readBytes(file);
    EXPECT_EQ(LLVMFuzzerTestOneInput(bytes.data(), bytes.size()), 0);
    for (int i = 0; i < 10 && !bytes.empty(); ++i) {
      Bytes changed = bytes;
      for (int k = 0; k < 3; ++k) {
        changed[random() % changed.size()] = static_cast<std::uint8_t>(random());
      }
      EXPECT_EQ(LLVMFuzzerTestOneInput(changed.data(), changed.size()), 0);
    }
  }
}

}  // namespace
