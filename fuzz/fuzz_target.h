// SPDX-License-Identifier: BSD-3-Clause
// FUZZ_TARGET(name) { work on `data`, `size` bytes; return 0; }
//
// What libFuzzer calls. In tests it is a case, which works on the files in corpus/name.
#pragma once

#include <cstddef>
#include <cstdint>

#ifdef FUZZ_CORPORA
#include <gtest/gtest.h>

namespace cuboid_mapping {

/// Works on each file of a folder, and again with some changed bytes.
void replayCorpus(const char* folder, int (*work)(const std::uint8_t* data, std::size_t size));

}  // namespace cuboid_mapping

#define FUZZ_TARGET(name)                                                            \
  static int name(const std::uint8_t* data, std::size_t size);                       \
  TEST(Corpus, name) { cuboid_mapping::replayCorpus(FUZZ_CORPORA "/" #name, name); } \
  static int name(const std::uint8_t* data, std::size_t size)
#else
#define FUZZ_TARGET(name) \
  extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
#endif
