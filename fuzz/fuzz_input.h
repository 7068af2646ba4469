// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <string>

namespace cuboid_mapping {

/// Ends the program if a property does not hold, so that the fuzzer reports it.
inline void require(bool holds) {
  if (!holds) std::abort();
}

/// Takes values from the bytes of a fuzzer one after the other; zeros when they are used up.
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
  /// A number from 0 to `most`, from one byte.
  std::size_t upTo(std::size_t most) { return take<std::uint8_t>() % (most + 1); }
  bool chance() { return (take<std::uint8_t>() & 1) != 0; }

  /// A number mostly within a room, in steps of 1 cm; sometimes an extreme one.
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

  /// The remaining bytes.
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
