// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/sharing/map_follower.h"

#include <cstddef>
#include <deque>
#include <memory>
#include <mutex>
#include <vector>

namespace cuboid_mapping {

/// A MapFollower that threads read while another one updates it: a long reader holds up neither updates nor other
/// readers. Thread-safe.
///
/// A version that nobody reads is updated in place. While one is read, updates go into another: one of before that
/// gets the updates that it has missed, or else a copy. So the memory is that of one map, and of another one for each
/// reader that updates overtake.
class SharedMapFollower {
 public:
  /// A revision of the map. It does not change while it is held.
  using Version = std::shared_ptr<const MapFollower>;

  /// An empty copy.
  SharedMapFollower();
  ~SharedMapFollower();
  SharedMapFollower(const SharedMapFollower&) = delete;
  SharedMapFollower& operator=(const SharedMapFollower&) = delete;

  /// See MapFollower. Calls wait for each other.
  ///@{
  [[nodiscard]] bool take(MapImage image);
  [[nodiscard]] FollowResult take(MapDelta delta);
  ///@}

  /// The current version; never null. It waits for at most one update in place.
  [[nodiscard]] Version read() const;

 private:
  struct Counted;

  void setCurrent(std::shared_ptr<Counted> version);
  [[nodiscard]] bool takeInPlace(MapDelta& delta);
  [[nodiscard]] std::shared_ptr<Counted> takeSpare();
  void noteMissed(MapDelta delta);
  void forgetSpares();

  std::mutex updating_;                           ///< Held by the thread that updates.
  mutable std::mutex mutex_;                      ///< Guards `current_`.
  std::shared_ptr<Counted> current_;              ///< Written by the holder of `updating_`.
  std::vector<std::shared_ptr<Counted>> spares_;  ///< Versions of before, perhaps still read.
  std::deque<MapDelta> missed_;                   ///< Changes that some of the spares lack.
  std::size_t num_missed_ = 0;                    ///< Number of these, and of their bricks.
};

}  // namespace cuboid_mapping
