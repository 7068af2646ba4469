// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <random>
#include <string>
#include <utility>
#include <vector>

namespace cuboid_mapping::test {

/// Seed of all random tests: 1, or the environment variable CUBOID_MAPPING_TEST_SEED. It is printed once
/// per program, so that a failure can be repeated.
inline std::uint64_t testSeed() {
  static const std::uint64_t kSeed = [] {
    const char* text = std::getenv("CUBOID_MAPPING_TEST_SEED");
    const std::uint64_t seed = text != nullptr ? std::strtoull(text, nullptr, 10) : 1;
    std::cout << "CUBOID_MAPPING_TEST_SEED=" << seed << std::endl;
    return seed;
  }();
  return kSeed;
}

/// Random numbers of one test: the same for a seed and stream with every compiler, unlike those of
/// the standard library's distributions.
class Random {
 public:
  /// @param stream  Distinguishes tests, or runs in a test, with the same seed.
  explicit Random(std::uint64_t stream = 0) : engine_(testSeed() * 0x9E3779B97F4A7C15ULL + stream) {
    engine_.discard(8);
  }

  /// Number from `first` to `last`, both included.
  int integer(int first, int last) {
    const auto span = static_cast<std::uint64_t>(static_cast<std::int64_t>(last) - first) + 1;
    return static_cast<int>(first + static_cast<std::int64_t>(engine_() % span));
  }

  /// Number from `lower` (included) to `upper` (excluded).
  double real(double lower, double upper) {
    return lower + (upper - lower) * (static_cast<double>(engine_() >> 11) * 0x1p-53);
  }

  bool chance(double probability) { return real(0.0, 1.0) < probability; }

  std::uint64_t bits() { return engine_(); }

  /// Index into a container of this size. @pre size > 0.
  std::size_t index(std::size_t size) { return static_cast<std::size_t>(engine_() % size); }

  template <typename T>
  void shuffle(std::vector<T>& items) {
    for (std::size_t i = items.size(); i > 1; --i) std::swap(items[i - 1], items[index(i)]);
  }

 private:
  std::mt19937_64 engine_;
};

/// Text of a failing random test.
inline std::string seedNote(std::size_t case_number) {
  return "CUBOID_MAPPING_TEST_SEED=" + std::to_string(testSeed()) + ", case " +
         std::to_string(case_number);
}

}  // namespace cuboid_mapping::test
