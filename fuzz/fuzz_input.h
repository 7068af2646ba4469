// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <string>

namespace cuboid_mapping {

/// What has to hold whatever the bytes are: otherwise the fuzzer has found something.
inline void require(bool holds) {
  if (!holds) std::abort();
}

/// Takes values out of the bytes of a fuzzer one after the other; zeros when they are used up.
class FuzzInput {
 public:
  FuzzInput(const std::uint8_t* data, std::size_t size) : data_(data), left_(size) {}

  [[nodiscard]] bool isEmpty() const { return left_ == 0; }

  template <typename T>
  T take() {
    T value{};
    const std::size_t count = left_ < sizeof(T) ? left_ : sizeof(T);
    if (count > 0) std::memcpy(&value, data_, count);
    skip(count);
    return value;
  }
  /// From 0 to `most`, of one byte.
  std::size_t upTo(std::size_t most) { return take<std::uint8_t>() % (most + 1); }
  bool chance() { return (take<std::uint8_t>() & 1) != 0; }

  /// A number of the size of a room mostly, in steps of 1 cm; now and then one that nobody expects.
  double number() {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    constexpr std::array<double, 12> kOdd{
        0.0,          -0.0,  kInfinity, -kInfinity, std::numeric_limits<double>::quiet_NaN(),
        1e-30,        1e30,  1e300,     1e7,        -1e7,
        2147483648.0, 1e-310};
    const auto kind = take<std::uint8_t>();
    if (kind < kOdd.size()) return kOdd[kind];
    if (kind == kOdd.size()) return take<double>();
    return 0.01 * take<std::int16_t>() / (kind < 128 ? 100.0 : 1.0);
  }

  /// What is left.
  std::string rest() {
    std::string bytes(reinterpret_cast<const char*>(data_), left_);
    left_ = 0;
    return bytes;
  }

 private:
  void skip(std::size_t count) {
    data_ += count;
    left_ -= count;
  }

  const std::uint8_t* data_;
  std::size_t left_;
};

}  // namespace cuboid_mapping
