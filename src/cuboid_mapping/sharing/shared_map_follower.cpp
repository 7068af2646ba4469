// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/sharing/shared_map_follower.h"

#include <algorithm>
#include <atomic>
#include <utility>

namespace cuboid_mapping {

/// A version with the number of its readers. Only the current one gets new readers.
struct SharedMapFollower::Counted {
  MapFollower follower;
  std::atomic<int> num_readers{0};

  [[nodiscard]] bool isRead() const { return num_readers.load(std::memory_order_acquire) > 0; }
};

SharedMapFollower::SharedMapFollower() : current_(std::make_shared<Counted>()) {}
SharedMapFollower::~SharedMapFollower() = default;

SharedMapFollower::Version SharedMapFollower::read() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++current_->num_readers;
  return {&current_->follower, [version = current_](const MapFollower*) {
            version->num_readers.fetch_sub(1, std::memory_order_release);
          }};
}

void SharedMapFollower::setCurrent(std::shared_ptr<Counted> version) {
  const std::lock_guard<std::mutex> lock(mutex_);
  current_.swap(version);
}

void SharedMapFollower::forgetSpares() {
  spares_.clear();
  missed_.clear();
  num_missed_ = 0;
}

bool SharedMapFollower::take(MapImage image) {
  const std::lock_guard<std::mutex> turn(updating_);
  const MapFollower& now = current_->follower;
  const bool is_old =
      now.map() != nullptr && image.instance == now.instance() && image.revision < now.revision();
  if (is_old) return true;
  auto fresh = std::make_shared<Counted>();
  if (!fresh->follower.take(std::move(image))) return false;
  forgetSpares();
  setCurrent(std::move(fresh));
  return true;
}

FollowResult SharedMapFollower::take(MapDelta delta) {
  const std::lock_guard<std::mutex> turn(updating_);
  const FollowResult result = current_->follower.check(delta);
  if (result != FollowResult::kApplied || takeInPlace(delta)) return result;
  const std::shared_ptr<Counted> next = takeSpare();
  for (const MapDelta& missed : missed_) {
    if (missed.revision > next->follower.revision()) (void)next->follower.take(missed);
  }
  (void)next->follower.take(delta);
  spares_.reserve(spares_.size() + 1);
  noteMissed(std::move(delta));
  spares_.push_back(current_);  // Nothing throws from here on.
  setCurrent(next);
  return result;
}

/// Keeps a change that the spares lack, and forgets those that they all have.
void SharedMapFollower::noteMissed(MapDelta delta) {
  missed_.push_back(std::move(delta));
  num_missed_ += 1 + missed_.back().bricks.size();
  std::uint64_t oldest = current_->follower.revision();
  for (const auto& spare : spares_) oldest = std::min(oldest, spare->follower.revision());
  while (!missed_.empty() && missed_.front().revision <= oldest) {
    num_missed_ -= 1 + missed_.front().bricks.size();
    missed_.pop_front();
  }
}

/// Updates the current version if nobody reads it: readers wait meanwhile.
bool SharedMapFollower::takeInPlace(MapDelta& delta) {
  // A spare that has missed more than a copy costs is of no use.
  if (num_missed_ > 100 + current_->follower.map()->voxels().size()) forgetSpares();
  const std::lock_guard<std::mutex> lock(mutex_);
  if (current_->isRead()) return false;
  if (!spares_.empty()) noteMissed(delta);
  return current_->follower.take(std::move(delta)) == FollowResult::kApplied;
}

/// A version that nobody reads: the newest spare, or a copy of the current version.
std::shared_ptr<SharedMapFollower::Counted> SharedMapFollower::takeSpare() {
  const auto spare = std::find_if(spares_.rbegin(), spares_.rend(),
                                  [](const auto& version) { return !version->isRead(); });
  if (spare == spares_.rend()) {
    auto copy = std::make_shared<Counted>();
    copy->follower = current_->follower.copy();
    return copy;
  }
  std::shared_ptr<Counted> found = *spare;
  spares_.erase(std::next(spare).base());
  // One more free version is enough.
  spares_.erase(std::remove_if(spares_.begin(), spares_.end(),
                               [](const auto& version) { return !version->isRead(); }),
                spares_.end());
  return found;
}

}  // namespace cuboid_mapping
