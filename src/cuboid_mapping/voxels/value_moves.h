// SPDX-License-Identifier: BSD-3-Clause
// Log-odds of a brick, by number, and their changes, while PackedVoxels computes new ones.
#pragma once

#include "cuboid_mapping/geometry/brick_mask.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <new>
#include <type_traits>
#include <vector>

namespace cuboid_mapping {

/// Log-odds of a number that no voxel has.
constexpr float kVacant = std::numeric_limits<float>::quiet_NaN();

/// The log-odds of one class. A number is vacant if no voxel has its log-odds any more: kVacant.
class ClassValues {
 public:
  [[nodiscard]] int size() const { return size_; }
  [[nodiscard]] float operator[](int number) const {
    return values_[static_cast<std::size_t>(number)];
  }
  [[nodiscard]] const float* data() const { return values_.data(); }
  void assign(const float* values, int size) {
    std::copy(values, values + size, values_.begin());
    size_ = size;
  }
  void vacate(int number) { values_[static_cast<std::size_t>(number)] = kVacant; }

  /// The number of a log-odds: its own, else a vacant one, `preferred` first, else a new one.
  int numberOf(float log_odds, int preferred) {
    int vacant = -1;
    for (int i = 0; i < size_; ++i) {
      const float value = (*this)[i];
      if (value == log_odds) return i;
      if (std::isnan(value) && vacant != preferred) vacant = i;
    }
    if (vacant < 0) vacant = size_++;
    values_[static_cast<std::size_t>(vacant)] = log_odds;
    return vacant;
  }

  /// Removes the last number. @return Its log-odds.
  float pop() { return values_[static_cast<std::size_t>(--size_)]; }
  void put(int number, float log_odds) { values_[static_cast<std::size_t>(number)] = log_odds; }

 private:
  std::array<float, kBrickVoxels> values_;  // NOLINT: most of it stays unused
  int size_ = 0;
};

/// Voxels that change from one log-odds to another.
struct Move {
  BrickMask voxels;
  float to = 0.0F;
  bool is_from_occupied = false;
  int from = -1;         ///< Number of the old log-odds; -1: unknown.
  bool is_last = false;  ///< No voxel keeps the old log-odds.
};

/// Moves of a brick. The first few need no allocation, and are not initialized.
class Moves {
 public:
  void push(const Move& move) {
    if (size_ < kFew) {
      new (few_ + size_++ * sizeof(Move)) Move(move);
    } else {
      more_.push_back(move);
    }
  }
  [[nodiscard]] bool isEmpty() const { return size_ == 0; }
  [[nodiscard]] Move& last() { return more_.empty() ? few(size_ - 1) : more_.back(); }
  template <typename VisitorT>
  void forEach(VisitorT visit) {
    for (std::size_t i = 0; i < size_; ++i) visit(few(i));
    for (const Move& move : more_) visit(move);
  }

 private:
  static constexpr std::size_t kFew = 16;
  static_assert(std::is_trivially_destructible_v<Move>);

  [[nodiscard]] Move& few(std::size_t i) {
    return *std::launder(reinterpret_cast<Move*>(few_ + i * sizeof(Move)));
  }

  alignas(Move) std::byte few_[kFew * sizeof(Move)];
  std::size_t size_ = 0;
  std::vector<Move> more_;
};

}  // namespace cuboid_mapping
