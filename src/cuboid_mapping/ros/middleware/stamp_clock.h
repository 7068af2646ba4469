// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>

namespace cuboid_mapping_ros {

/// One time for messages of several sources, whose clocks may differ, and some of whose stamps may be wrong.
///
/// A step of the stamps by more than a second is believed when the next message of the source is nearer to it than to
/// the stamps before: one leading stamp does not lead the others. now_ns() does not go back: a source whose clock is set
/// back, or is not that of the others, goes on from it.
class StampClock {
 public:
  /// Notes a message. @return Its time; with a stamp that is not believed, that of the source's message before.
  std::int64_t note(std::int64_t stamp_ns, std::size_t source) {
    const auto [found, is_first] = sources_.try_emplace(source, Source{stamp_ns, 0, std::nullopt});
    Source& own = found->second;
    if (is_first && now_ns_ && !isNear(stamp_ns, *now_ns_)) own.offset_ns = *now_ns_ - stamp_ns;
    if (stamp_ns == own.doubted_ns)
      return own.last_ns + own.offset_ns;  // Its twin confirms nothing.
    if (own.doubted_ns && distance(stamp_ns, *own.doubted_ns) < distance(stamp_ns, own.last_ns)) {
      if (*own.doubted_ns < own.last_ns) own.offset_ns = *now_ns_ - *own.doubted_ns;
      own.last_ns = *own.doubted_ns;
    }
    own.doubted_ns.reset();
    isNear(stamp_ns, own.last_ns) ? (void)(own.last_ns = stamp_ns)
                                  : (void)(own.doubted_ns = stamp_ns);
    const std::int64_t time_ns = own.last_ns + own.offset_ns;
    now_ns_ = std::max(now_ns_.value_or(time_ns), time_ns);
    return time_ns;
  }

  /// Whether the last stamp of a source is believed.
  [[nodiscard]] bool isBelieved(std::size_t source) const {
    const auto found = sources_.find(source);
    return found == sources_.end() || !found->second.doubted_ns;
  }
  /// The latest time; 0 before the first message.
  [[nodiscard]] std::int64_t now_ns() const { return now_ns_.value_or(0); }

 private:
  struct Source {
    std::int64_t last_ns;                    ///< Last stamp that is believed.
    std::int64_t offset_ns;                  ///< From its stamps to the times.
    std::optional<std::int64_t> doubted_ns;  ///< The stamp after it, until the next one.
  };

  static std::int64_t distance(std::int64_t a, std::int64_t b) { return a < b ? b - a : a - b; }
  static bool isNear(std::int64_t a, std::int64_t b) { return distance(a, b) <= 1000000000; }

  std::map<std::size_t, Source> sources_;
  std::optional<std::int64_t> now_ns_;
};

}  // namespace cuboid_mapping_ros
