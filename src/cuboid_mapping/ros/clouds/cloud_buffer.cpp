// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/clouds/cloud_buffer.h"

#include "cuboid_mapping/ros/diagnostics/diagnostics.h"

#include <algorithm>
#include <chrono>
#include <exception>
#include <sstream>
#include <utility>

namespace cuboid_mapping_ros {
namespace {

/// Stamps of a source that go back by more mean a restart.
constexpr double kRestart_s = 10.0;
/// Minimum time after a message before its source counts as silent.
constexpr double kSilence_s = 1.0;
/// Time for which waitNext() sleeps when a cloud waits for the order, or for tf.
constexpr std::chrono::milliseconds kHeldPeriod{10};
constexpr std::chrono::milliseconds kWaitingPeriod{100};
constexpr std::chrono::seconds kIdlePeriod{1};

/// Difference without ros::Duration, which throws beyond 2^31 s.
double secondsBetween(const ros::Time& from, const ros::Time& to) {
  return to.toSec() - from.toSec();
}

/// Runs work that fills in a text. Without memory, the text stays empty, or nothing is logged.
template <typename WorkT>
void ifMemory(const WorkT& work) {
  try {
    work();
  } catch (const std::exception&) {
  }
}

std::string megabytes(std::size_t num_bytes) {
  return std::to_string((num_bytes + 500000) / 1000000) + " MB";
}

}  // namespace

CloudLimits makeCloudLimits(const NodeParameters& parameters) {
  CloudLimits limits;
  limits.num_sources = sourcesOf(parameters).size();
  limits.order_wait_s = parameters.order_wait_s;
  limits.queue_size = static_cast<std::size_t>(parameters.queue_size);
  limits.max_bytes = static_cast<std::size_t>(parameters.queue_memory_mb) * 1000000;
  limits.tf_wait_s = parameters.tf_wait_s;
  return limits;
}

double steadySeconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

CloudBuffer::CloudBuffer(const CloudLimits& limits, Callbacks callbacks)
    : limits_(limits), callbacks_(std::move(callbacks)), sources_(limits.num_sources) {}

void CloudBuffer::put(const SensorMessage& cloud) {
  const std::lock_guard<std::mutex> lock(mutex_);
  noteStamp(cloud, callbacks_.clock_s());
  if (cloud.header().frame_id.empty()) return refuse(cloud.source, DropReason::kEmptyFrame);
  try {
    insert(cloud);
  } catch (const std::exception&) {
    return refuse(cloud.source, DropReason::kInternalError);
  }
  makeRoom();
  has_news_ = true;
  wake_.notify_one();
}

void CloudBuffer::refuse(std::size_t source, DropReason reason) {
  std::string text;
  ifMemory([&] { text = toAdvice(reason); });
  callbacks_.drop(source, reason, text);
}

void CloudBuffer::noteStamp(const SensorMessage& cloud, double now_s) {
  const ros::Time& stamp = cloud.header().stamp;
  Source& source = sources_.at(cloud.source);
  if (secondsBetween(stamp, source.newest) > kRestart_s && !stamp.isZero()) {
    // Clouds before the jump do not count.
    for (Source& other : sources_) other.newest = ros::Time();
    last_taken_ = ros::Time();
  }
  const auto has_spoken = [](const Source& other) { return other.has_spoken; };
  if (std::none_of(sources_.begin(), sources_.end(), has_spoken)) {
    for (Source& other : sources_) other.last_put_s = now_s;
  }
  source.gap_s = source.has_spoken ? now_s - source.last_put_s : 0.0;
  source.has_spoken = true;
  source.newest = stamp;
  source.last_put_s = now_s;
}

void CloudBuffer::insert(const SensorMessage& cloud) {
  Entry entry;
  entry.cloud = cloud;
  entry.since = callbacks_.now();
  entry.put_s = callbacks_.clock_s();
  entries_.insert(placeOf(cloud), std::move(entry));
  num_bytes_ += cloud.numBytes();  // From here on nothing throws.
  sources_[cloud.source].num_bytes += cloud.numBytes();
}

CloudBuffer::Entries::iterator CloudBuffer::placeOf(const SensorMessage& cloud) {
  if (limits_.num_sources == 1) return entries_.end();
  const auto key = [](const SensorMessage& of) {
    return std::make_pair(of.header().stamp, of.source);
  };
  return std::upper_bound(
      entries_.begin(), entries_.end(), cloud,
      [&key](const SensorMessage& a, const Entry& b) { return key(a) < key(b.cloud); });
}

void CloudBuffer::makeRoom() {
  while (num_bytes_ > limits_.max_bytes && entries_.size() > 1) {
    const auto greatest = std::max_element(
        sources_.begin(), sources_.end(),
        [](const Source& a, const Source& b) { return a.num_bytes < b.num_bytes; });
    const auto source = static_cast<std::size_t>(greatest - sources_.begin());
    const auto waiting = newestOf(source, false);
    if (waiting != entries_.end()) {
      drop(waiting, DropReason::kNoTransform);
    } else {
      drop(newestOf(source, true), DropReason::kQueueFull);
    }
  }
}

void CloudBuffer::dropOverload() {
  const double now_s = callbacks_.clock_s();
  for (std::size_t source = 0; source < sources_.size(); ++source) {
    std::optional<Backlog>& backlog = sources_[source].backlog;
    std::size_t count = countReady(source);
    if (count <= limits_.queue_size) {
      backlog.reset();
    } else if (!backlog || count < backlog->least) {
      backlog = Backlog{count, now_s};
    } else if (now_s - backlog->since_s > kBurst_s) {
      for (; count > limits_.queue_size; --count) {
        drop(newestOf(source, true), DropReason::kQueueFull);
      }
    }
  }
}

std::size_t CloudBuffer::countReady(std::size_t source) const {
  return static_cast<std::size_t>(std::count_if(
      entries_.begin(), entries_.end(),
      [source](const Entry& entry) { return entry.isReady() && entry.cloud.source == source; }));
}

CloudBuffer::Entries::iterator CloudBuffer::newestOf(std::size_t source, bool is_ready) {
  for (auto entry = entries_.end(); entry != entries_.begin();) {
    --entry;
    if (entry->cloud.source == source && entry->isReady() == is_ready) return entry;
  }
  return entries_.end();
}

void CloudBuffer::noteTfChanged() {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (entries_.empty()) return;
  has_news_ = true;
  wake_.notify_one();
}

void CloudBuffer::setSearch(FindPoses find_poses) {
  const std::lock_guard<std::mutex> lock(mutex_);
  callbacks_.find_poses = std::move(find_poses);
  for (Entry& entry : entries_) entry.search = PoseSearch();
  has_news_ = true;
  wake_.notify_one();
}

void CloudBuffer::stop() {
  const std::lock_guard<std::mutex> lock(mutex_);
  is_stopped_ = true;
  wake_.notify_all();
}

std::optional<PosedCloud> CloudBuffer::waitNext() {
  std::unique_lock<std::mutex> lock(mutex_);
  while (!is_stopped_) {
    has_news_ = false;
    if (auto next = takeNextLocked()) return next;
    const bool is_held = std::any_of(entries_.begin(), entries_.end(),
                                     [](const Entry& entry) { return entry.isReady(); });
    const std::chrono::milliseconds period = is_held            ? kHeldPeriod
                                             : entries_.empty() ? kIdlePeriod
                                                                : kWaitingPeriod;
    wake_.wait_for(lock, period, [this] { return has_news_ || is_stopped_; });
  }
  return std::nullopt;
}

std::optional<PosedCloud> CloudBuffer::takeNext() {
  const std::lock_guard<std::mutex> lock(mutex_);
  return takeNextLocked();
}

bool CloudBuffer::hasNext() {
  const std::lock_guard<std::mutex> lock(mutex_);
  update();
  return findNext() != entries_.end();
}

std::optional<PosedCloud> CloudBuffer::takeNextLocked() {
  update();
  const auto next = findNext();
  if (next == entries_.end()) return std::nullopt;
  Entry entry = take(next);
  const ros::Time& stamp = entry.stamp();
  if (limits_.num_sources > 1 && stamp < last_taken_) ++num_out_of_order_;
  last_taken_ = stamp;
  return PosedCloud{std::move(entry.cloud), *std::move(entry.search.poses)};
}

void CloudBuffer::update() {
  const double now_s = callbacks_.clock_s();
  for (Source& source : sources_) source.blocked = nullptr;
  for (std::size_t i = 0; i < entries_.size();) {
    DropReason reason = DropReason::kNoTransform;
    if (entries_[i].isReady() || updateEntry(entries_[i], now_s, reason)) {
      ++i;
      continue;
    }
    // Entries move, so blocked ones are searched again.
    for (Source& source : sources_) source.blocked = nullptr;
    drop(entries_.begin() + static_cast<std::ptrdiff_t>(i), reason);
  }
  dropOverload();
}

bool CloudBuffer::updateEntry(Entry& entry, double now_s, DropReason& reason) {
  Source& source = sources_[entry.cloud.source];
  const Entry* const blocked = source.blocked;
  const bool is_blocked = blocked != nullptr && entry.stamp() >= blocked->stamp() &&
                          entry.cloud.header().frame_id == blocked->cloud.header().frame_id;
  if (!is_blocked) {
    search(entry, now_s);
    if (entry.isReady()) {
      source.is_off_clock = false;
      return true;
    }
    // If the node's time is near the cloud's, /clock itself has jumped back, and tf will notice it.
    if (entry.search.is_too_old && secondsBetween(entry.stamp(), callbacks_.now()) > kRestart_s) {
      source.is_off_clock = true;
      reason = DropReason::kTooOldForTf;
      return false;
    }
    if (entry.search.blocksLater()) source.blocked = &entry;
  } else if (entry.search.why.empty()) {
    ifMemory([&] { entry.search.why = blocked->search.why; });
    entry.search.lead_s = blocked->search.lead_s;
  }
  sayWaiting(entry, now_s);
  const ros::Time now = callbacks_.now();
  // The wait starts again after a jump back, or at the first /clock, before which simulated time is 0.
  if (now < entry.since || entry.since.isZero()) entry.since = now;
  return secondsBetween(entry.since, now) <= limits_.tf_wait_s;
}

/// Searches the poses of a cloud. Without memory for them the cloud waits.
void CloudBuffer::search(Entry& entry, double now_s) {
  try {
    if (!entry.slices) entry.slices = callbacks_.read_slices(entry.cloud);
    entry.search = callbacks_.find_poses(entry.cloud, *entry.slices);
    if (entry.isReady()) entry.ready_since_s = now_s;
  } catch (const std::exception&) {
    entry.search = PoseSearch();
  }
}

void CloudBuffer::sayWaiting(const Entry& entry, double now_s) {
  Source& source = sources_[entry.cloud.source];
  const bool is_said = source.said_waiting_s && now_s - *source.said_waiting_s < kSayAgain_s;
  if (now_s - entry.put_s <= kSayWaiting_s || is_said) return;
  source.said_waiting_s = now_s;
  ifMemory([&] { callbacks_.say_waiting(entry.cloud.source, describeMissing(entry)); });
}

void CloudBuffer::drop(const Entries::iterator& entry, DropReason reason) {
  const Entry gone = take(entry);
  std::string text;
  ifMemory([&] { text = describe(gone, reason); });
  callbacks_.drop(gone.cloud.source, reason, text);
}

std::string CloudBuffer::describe(const Entry& entry, DropReason reason) {
  std::ostringstream text;
  text << "frame '" << entry.cloud.header().frame_id << "', stamp " << entry.stamp() << ": ";
  if (reason == DropReason::kTooOldForTf) {
    Source& source = sources_[entry.cloud.source];
    if (std::exchange(source.has_named_clock, true)) return {};
    text << "its clock is " << describeAge(entry.search.lead_s.value_or(0.0))
         << " behind tf: " << toAdvice(reason);
  } else if (reason == DropReason::kNoTransform) {
    text << describeMissing(entry);
    if (num_bytes_ + entry.cloud.numBytes() > limits_.max_bytes) {
      text << "; " << entries_.size() << " clouds of " << megabytes(num_bytes_)
           << " wait: raise queue_memory, or send fewer or smaller clouds";
    }
  } else {
    text << entries_.size() << " clouds wait for their turn: " << toAdvice(reason);
  }
  return text.str();
}

std::string CloudBuffer::describeMissing(const Entry& entry) const {
  std::ostringstream text;
  text.precision(3);
  const double ahead_s = secondsBetween(entry.since, entry.stamp());
  const double waited_s = callbacks_.clock_s() - entry.put_s;
  text << "waited for " << waited_s << " s: " << entry.search.why;
  if (!entry.search.lead_s) {
    text << "; " << toAdvice(DropReason::kNoTransform);
  } else if (ahead_s > kMaxAhead_s) {
    text << "; its stamp was " << describeAge(ahead_s)
         << " ahead of this machine's clock: synchronize the clocks (chrony, ntp)";
  } else if (*entry.search.lead_s > 0.0) {
    text << "; the transforms come late: check their publisher, or raise tf_wait (now "
         << limits_.tf_wait_s << " s)";
  } else {
    text << "; tf begins after this cloud";
  }
  return text.str();
}

CloudBuffer::Entry CloudBuffer::take(const Entries::iterator& entry) {
  Entry taken = std::move(*entry);
  entries_.erase(entry);
  num_bytes_ -= taken.cloud.numBytes();
  sources_[taken.cloud.source].num_bytes -= taken.cloud.numBytes();
  return taken;
}

CloudBuffer::Entries::iterator CloudBuffer::findNext() {
  const double now_s = callbacks_.clock_s();
  const bool waits_for_order = limits_.num_sources > 1 && num_bytes_ <= limits_.max_bytes / 2;
  bool is_first = true;
  for (auto entry = entries_.begin(); entry != entries_.end(); ++entry) {
    if (!entry->isReady()) {
      is_first = false;
      continue;
    }
    const bool may_go = !waits_for_order || (is_first && !isHeldUp(*entry, now_s)) ||
                        now_s - entry->ready_since_s >= limits_.order_wait_s;
    return may_go ? entry : entries_.end();
  }
  return entries_.end();
}

bool CloudBuffer::isHeldUp(const Entry& entry, double now_s) const {
  return std::any_of(sources_.begin(), sources_.end(), [&](const Source& source) {
    const double usual_s = source.has_spoken ? std::max(kSilence_s, 2.0 * source.gap_s) : 0.0;
    const bool is_silent = now_s - source.last_put_s >= usual_s + limits_.order_wait_s;
    return source.newest < entry.stamp() && !source.is_off_clock && !is_silent;
  });
}

std::size_t CloudBuffer::size() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return entries_.size();
}

std::size_t CloudBuffer::numBytes() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return num_bytes_;
}

std::uint64_t CloudBuffer::numOutOfOrder() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return num_out_of_order_;
}

std::string CloudBuffer::whyItWaits() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto waiting = std::find_if(entries_.begin(), entries_.end(),
                                    [](const Entry& entry) { return !entry.isReady(); });
  return waiting == entries_.end() ? std::string() : waiting->search.why;
}

}  // namespace cuboid_mapping_ros
