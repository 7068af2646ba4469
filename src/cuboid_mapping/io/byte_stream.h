// SPDX-License-Identifier: BSD-3-Clause
// Numbers in little-endian byte order on every machine.
#pragma once

#include "cuboid_mapping/io/map_file_error.h"

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>

namespace cuboid_mapping {

/// @throws MapFileError (kCorrupted) that names the defect and the cure.
[[noreturn]] inline void failCorrupted(const std::string& what) {
  throw MapFileError(
      MapFileDefect::kCorrupted,
      "is damaged: " + what + ". Take another copy of the file, or save the map again");
}

/// Maps numbers near zero, on either side, to small numbers; and back.
///@{
[[nodiscard]] constexpr std::uint32_t toZigzag(std::int32_t value) {
  return static_cast<std::uint32_t>(value) << 1 ^ static_cast<std::uint32_t>(value >> 31);
}
[[nodiscard]] constexpr std::int32_t fromZigzag(std::uint32_t value) {
  return static_cast<std::int32_t>(value >> 1 ^ (0U - (value & 1U)));
}
///@}

/// Appends numbers to bytes.
class ByteWriter {
 public:
  void writeU32(std::uint32_t value) { writeLittleEndian(value); }
  void writeU64(std::uint64_t value) { writeLittleEndian(value); }
  void writeF32(float value) {
    std::uint32_t bits;
    std::memcpy(&bits, &value, sizeof(bits));
    writeLittleEndian(bits);
  }
  void writeF64(double value) {
    std::uint64_t bits;
    std::memcpy(&bits, &value, sizeof(bits));
    writeLittleEndian(bits);
  }
  /// Seven bits a byte, the least first; the highest bit says that more follow.
  void writeVarint(std::uint64_t value) {
    for (; value >= 0x80; value >>= 7) bytes_.push_back(static_cast<char>(value | 0x80));
    bytes_.push_back(static_cast<char>(value));
  }
  void writeBytes(std::string_view bytes) { bytes_.append(bytes); }

  [[nodiscard]] const std::string& bytes() const { return bytes_; }
  [[nodiscard]] std::string take() { return std::move(bytes_); }

 private:
  template <typename T>
  void writeLittleEndian(T value) {
    for (std::size_t i = 0; i < sizeof(T); ++i) bytes_.push_back(static_cast<char>(value >> 8 * i));
  }

  std::string bytes_;
};

/// Takes numbers from bytes. Every function throws MapFileError (kTruncated) at their end.
class ByteReader {
 public:
  explicit ByteReader(std::string_view bytes) : bytes_(bytes) {}

  [[nodiscard]] std::size_t numLeft() const { return bytes_.size() - position_; }
  [[nodiscard]] std::size_t position() const { return position_; }

  std::uint32_t readU32() { return readLittleEndian<std::uint32_t>(); }
  std::uint64_t readU64() { return readLittleEndian<std::uint64_t>(); }
  float readF32() {
    const std::uint32_t bits = readU32();
    float value;
    std::memcpy(&value, &bits, sizeof(value));
    return value;
  }
  double readF64() {
    const std::uint64_t bits = readU64();
    double value;
    std::memcpy(&value, &bits, sizeof(value));
    return value;
  }
  /// @throws MapFileError (kCorrupted) for more than 32 bits, too.
  std::uint32_t readVarint() {
    const std::uint64_t value = readVarint64();
    if (value > 0xFFFFFFFFU) failCorrupted("a number has too many bytes");
    return static_cast<std::uint32_t>(value);
  }
  /// @throws MapFileError (kCorrupted) for more than 63 bits, too.
  std::uint64_t readVarint64() {
    std::uint64_t value = 0;
    for (int shift = 0; shift < 63; shift += 7) {
      const auto byte = static_cast<unsigned char>(readBytes(1)[0]);
      value |= static_cast<std::uint64_t>(byte & 0x7F) << shift;
      if (byte < 0x80) return value;
    }
    failCorrupted("a number has too many bytes");
  }
  std::string_view readBytes(std::size_t count) {
    if (count > numLeft()) {
      throw MapFileError(MapFileDefect::kTruncated,
                         "ends too early: the file was not copied or written completely");
    }
    position_ += count;
    return bytes_.substr(position_ - count, count);
  }

 private:
  template <typename T>
  T readLittleEndian() {
    const std::string_view bytes = readBytes(sizeof(T));
    T value = 0;
    for (std::size_t i = 0; i < sizeof(T); ++i) {
      value |= static_cast<T>(static_cast<unsigned char>(bytes[i])) << 8 * i;
    }
    return value;
  }

  std::string_view bytes_;
  std::size_t position_ = 0;
};

}  // namespace cuboid_mapping
