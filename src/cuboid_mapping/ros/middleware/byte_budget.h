// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>

namespace cuboid_mapping_ros {

/// Bytes that may be sent. Unused bytes are saved for a second. A message is sent whole as soon as nothing is owed, and
/// the excess over the savings is owed: in any time t at most `rate` * (t + 1 s) and one message are sent.
///
/// Times come from any clock that does not jump. Not thread-safe.
class ByteBudget {
 public:
  /// @param rate  Bytes per second; 0: no limit.
  explicit ByteBudget(double rate) : rate_(rate), saved_(rate) {}

  /// Whether a message may be sent. @param now_s  Not earlier than in previous calls.
  [[nodiscard]] bool isFree(double now_s) {
    saved_ = std::min(rate_, saved_ + rate_ * (now_s - last_s_));
    last_s_ = now_s;
    return rate_ == 0.0 || saved_ > 0.0;
  }
  void spend(std::size_t num_bytes) { saved_ -= static_cast<double>(num_bytes); }

 private:
  double rate_;
  double saved_;  ///< Saved bytes; negative: owed bytes.
  double last_s_ = 0.0;
};

}  // namespace cuboid_mapping_ros
