// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/time.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace cuboid_mapping_ros {

/// Limits the messages per second, by their stamps: one in each slot of 1 / rate. Replays of a recording
/// therefore pass the same messages.
///
/// Stamps may jitter by a quarter of a slot: a sensor of exactly this rate loses none if they fall on the
/// border of two.
class RateLimit {
 public:
  /// @param max_rate_hz  >= 0; 0: no limit.
  explicit RateLimit(double max_rate_hz) : max_rate_hz_(max_rate_hz) {}

  /// Whether a message may pass; call it for every message. A stamp of 0 always passes.
  [[nodiscard]] bool allows(const ros::Time& stamp) {
    if (max_rate_hz_ == 0.0 || stamp.isZero()) return true;
    const double place = stamp.toSec() * max_rate_hz_;
    const auto slot = static_cast<std::int64_t>(std::floor(place));
    if (slot < next_ - 2) next_ = 0;  // Stamps have jumped back.
    if (place < static_cast<double>(next_) - 0.25) return false;
    next_ = std::max(next_, slot) + 1;
    return true;
  }

 private:
  double max_rate_hz_;
  std::int64_t next_ = 0;  ///< Slot whose message may pass next.
};

/// Bytes that may be sent. Unused bytes are saved for a second. A message is sent whole as soon as nothing is
/// owed, and the excess over the savings is owed: in any time t at most `rate` * (t + 1 s) and one message are
/// sent.
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
