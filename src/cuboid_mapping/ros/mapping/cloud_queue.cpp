// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/mapping/cloud_queue.h"

#include "cuboid_mapping/ros/diagnostics/diagnostics.h"
#include "cuboid_mapping/ros/middleware/tf_buffer.h"
#include "cuboid_mapping/ros/middleware/tf_lookup.h"

#include <algorithm>
#include <chrono>
#include <exception>
#include <iterator>
#include <sstream>
#include <utility>

namespace cuboid_mapping_ros {
namespace {

/// Period in which tf is asked again for clouds that wait, and the longest sleep without any.
constexpr std::chrono::milliseconds kTfPeriod{50};
constexpr std::chrono::milliseconds kIdlePeriod{1000};

/// Time in which simulated time may jump back after a cloud.
constexpr double kClockPatience_s = 1.0;

/// Of a cloud that is too old for tf. A source whose clouds had transforms has a good clock.
std::string describeDelay(double delay_s, bool has_good_clock) {
  constexpr double kLongest_s = 3600.0;
  std::string text = "its stamp is " + describeAge(delay_s) + " behind tf: ";
  if (has_good_clock && delay_s <= kLongest_s) {
    text +=
        "it came late, as after a standstill of this node or the network, whose clouds are "
        "lost; if this goes on, ";
  }
  return text;
}

/// Runs work that makes a text. Without memory, the text stays empty, or nothing is logged.
template <typename WorkT>
void unlessOutOfMemory(const WorkT& work) {
  try {
    work();
  } catch (const std::exception&) {
  }
}

}  // namespace

CloudLimits makeCloudLimits(const NodeParameters& parameters) {
  CloudLimits limits;
  limits.num_sources = sourcesOf(parameters).size();
  limits.queue_size = static_cast<std::size_t>(parameters.queue_size);
  limits.tf_wait_s = parameters.tf_wait_s;
  limits.max_waiting_bytes /= limits.num_sources;
  return limits;
}

double steadySeconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

CloudQueue::CloudQueue(const CloudLimits& limits, Callbacks callbacks)
    : limits_(limits), callbacks_(std::move(callbacks)), sources_(limits.num_sources) {}

void CloudQueue::put(const SensorMessage& cloud) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!hasFrame(cloud.header())) return refuse(cloud.source, DropReason::kEmptyFrame);
  Source& source = sources_.at(cloud.source);
  try {
    Entry entry;
    entry.cloud = cloud;
    entry.num_bytes = cloud.numBytes();
    entry.since = callbacks_.now();
    entry.arrival_s = callbacks_.clock_s();
    source.waiting.push_back(std::move(entry));
  } catch (const std::exception&) {
    return refuse(cloud.source, DropReason::kInternalError);
  }
  source.num_waiting_bytes += source.waiting.back().num_bytes;
  update(source);
  limitWaiting(source);
  limitReady(source);
  has_news_ = true;
  wake_.notify_one();
}

void CloudQueue::searchAgain() {
  const std::lock_guard<std::mutex> lock(mutex_);
  for (Source& source : sources_) {
    for (Entry& entry : source.ready) {
      entry.search = PoseSearch();
      source.num_waiting_bytes += entry.num_bytes;
    }
    source.waiting.splice(source.waiting.begin(), source.ready);
    for (Entry& entry : source.waiting) entry.slices.reset();
  }
  has_news_ = true;
  wake_.notify_one();
}

void CloudQueue::stop() {
  const std::lock_guard<std::mutex> lock(mutex_);
  is_stopped_ = true;
  wake_.notify_all();
}

bool CloudQueue::waitReady() {
  std::unique_lock<std::mutex> lock(mutex_);
  while (!is_stopped_) {
    has_news_ = false;
    if (findNext() != nullptr) return true;
    const bool is_waiting = std::any_of(sources_.begin(), sources_.end(), [](const Source& source) {
      return !source.waiting.empty();
    });
    wake_.wait_for(lock, is_waiting ? kTfPeriod : kIdlePeriod,
                   [this] { return has_news_ || is_stopped_; });
  }
  return false;
}

CloudQueue::Source* CloudQueue::findNext() {
  Source* next = nullptr;
  for (Source& source : sources_) {
    update(source);
    limitReady(source);
    if (source.ready.empty()) continue;
    if (next == nullptr || source.last_turn < next->last_turn) next = &source;
  }
  if (next == nullptr) busy_since_s_.reset();
  return next;
}

std::optional<PosedCloud> CloudQueue::takeNext() {
  const std::lock_guard<std::mutex> lock(mutex_);
  Source* const next = findNext();
  if (next == nullptr) return std::nullopt;
  if (!busy_since_s_) busy_since_s_ = callbacks_.clock_s();
  next->last_turn = ++num_turns_;
  Entry entry = std::move(next->ready.front());
  next->ready.pop_front();
  return PosedCloud{std::move(entry.cloud), *std::move(entry.search.poses), entry.arrival_s};
}

void CloudQueue::update(Source& source) {
  const Entry* blocked = nullptr;
  for (auto entry = source.waiting.begin(); entry != source.waiting.end();) {
    const auto current = entry++;
    search(*current, blocked);
    if (current->search.poses) {
      source.num_waiting_bytes -= current->num_bytes;
      source.has_named_clock = false;
      source.has_had_poses = true;
      source.ready.splice(source.ready.end(), source.waiting, current);
    } else if (const auto reason = findReason(*current)) {
      drop(source, source.waiting, current, *reason);
    } else {
      blocked = &*current;
      sayWaiting(source, *current);
    }
  }
}

void CloudQueue::search(Entry& entry, const Entry* blocked) {
  try {
    if (blocked != nullptr && entry.header().stamp >= blocked->header().stamp &&
        entry.header().frame_id == blocked->header().frame_id) {
      entry.search = blocked->search;
      return;
    }
    if (!entry.slices) entry.slices = callbacks_.find_slices(entry.cloud);
    entry.search = callbacks_.find_poses(entry.cloud, *entry.slices);
  } catch (const std::exception&) {
    entry.search = PoseSearch();  // There is no memory for its poses: it waits.
  }
}

std::optional<DropReason> CloudQueue::findReason(Entry& entry) const {
  const PoseSearch& search = entry.search;
  const ros::Time now = callbacks_.now();
  const double back_s = entry.since.toSec() - now.toSec();
  // The wait starts again after a jump back, or at the first /clock, before which simulated time is 0.
  if (back_s > 0.0 || entry.since.isZero()) entry.since = now;
  // A cloud of the run before a jump back; those of the new run may arrive before its first /clock.
  const double ahead_s = entry.header().stamp.toSec() - now.toSec();
  if (std::min(back_s, ahead_s) > TfReceiver::kMinJump_s) return DropReason::kBeforeTf;
  if (search.hopeless == DropReason::kBeforeTf) {
    const double stamp_s = entry.header().stamp.toSec();
    const double newest_tf_s = stamp_s - search.lead_s.value_or(0.0);
    // tf from the future: the node's clock has jumped back, and TfReceiver will notice it.
    const bool has_jumped = newest_tf_s > now.toSec() + TfReceiver::kMinJump_s;
    // On arrival it was older than what tf keeps, although tf was not.
    const double oldest_s = std::min(entry.since.toSec(), newest_tf_s) - search.cache_s;
    // A recording that starts again may send clouds before its first /clock.
    const bool may_jump =
        ros::Time::isSimTime() && callbacks_.clock_s() - entry.arrival_s < kClockPatience_s;
    if (stamp_s < oldest_s && may_jump) return std::nullopt;
    if (stamp_s < oldest_s) return DropReason::kTooOldForTf;
    if (!has_jumped) return DropReason::kBeforeTf;
  } else if (search.hopeless) {
    return search.hopeless;
  }
  // Not by ros::Duration, which throws beyond 2^31 s.
  if (now.toSec() - entry.since.toSec() <= limits_.tf_wait_s) return std::nullopt;
  return DropReason::kNoTransform;
}

/// The newest goes: the oldest gets its transforms first.
void CloudQueue::limitWaiting(Source& source) {
  while (source.num_waiting_bytes > limits_.max_waiting_bytes && source.waiting.size() > 1) {
    drop(source, source.waiting, std::prev(source.waiting.end()), DropReason::kNoTransform);
  }
}

void CloudQueue::limitReady(Source& source) {
  if (!busy_since_s_ || callbacks_.clock_s() - *busy_since_s_ <= kBurst_s) return;
  while (source.ready.size() > limits_.queue_size) {
    drop(source, source.ready, source.ready.begin(), DropReason::kQueueFull);
  }
}

void CloudQueue::sayWaiting(Source& source, const Entry& entry) {
  const double now_s = callbacks_.clock_s();
  const bool is_said = source.said_waiting_s && now_s - *source.said_waiting_s < kSayAgain_s;
  if (now_s - entry.arrival_s <= kSayWaiting_s || is_said) return;
  source.said_waiting_s = now_s;
  unlessOutOfMemory([&] { callbacks_.say_waiting(entry.cloud.source, describeMissing(entry)); });
}

void CloudQueue::drop(Source& source, Entries& from, Entries::iterator entry, DropReason reason) {
  std::string text;
  unlessOutOfMemory([&] { text = describe(source, *entry, reason); });
  if (&from == &source.waiting) source.num_waiting_bytes -= entry->num_bytes;
  callbacks_.drop(entry->cloud.source, reason, text);
  from.erase(entry);
}

void CloudQueue::refuse(std::size_t source, DropReason reason) {
  std::string text;
  unlessOutOfMemory([&] { text = toAdvice(reason); });
  callbacks_.drop(source, reason, text);
}

std::string CloudQueue::describe(Source& source, const Entry& entry, DropReason reason) const {
  std::ostringstream text;
  text << "frame '" << entry.header().frame_id << "', stamp " << entry.header().stamp << ": ";
  switch (reason) {
    case DropReason::kTooOldForTf:
      if (std::exchange(source.has_named_clock, true)) return {};
      text << describeDelay(-entry.search.lead_s.value_or(0.0), source.has_had_poses);
      break;
    case DropReason::kBeforeTf: break;
    case DropReason::kTfGap: text << entry.search.why << ": "; break;
    case DropReason::kNoTransform:
      if (entry.search.hopeless) return text.str() + describeCause(entry);
      text << describeMissing(entry) << "; " << source.waiting.size() << " of its clouds wait";
      if (source.waiting.size() > 1 && source.num_waiting_bytes > limits_.max_waiting_bytes) {
        text << ", of which at most " << limits_.max_waiting_bytes / 1000000 << " MB may";
      }
      return text.str();
    default: text << source.ready.size() << " clouds wait for their turn: "; break;
  }
  text << toAdvice(reason);
  return text.str();
}

std::string CloudQueue::describeMissing(const Entry& entry) const {
  return "waited for " + describeAge(callbacks_.clock_s() - entry.arrival_s) + ": " +
         describeCause(entry);
}

std::string CloudQueue::describeCause(const Entry& entry) const {
  std::ostringstream text;
  const double ahead_s = entry.header().stamp.toSec() - entry.since.toSec();
  text << entry.search.why;
  if (entry.search.names_cure) return text.str();
  if (!entry.search.lead_s) {
    text << "; " << toAdvice(DropReason::kNoTransform);
  } else if (ahead_s > kMaxAhead_s) {
    text << "; its stamp was " << describeAge(ahead_s) << " ahead of "
         << (ros::Time::isSimTime()
                 ? "/clock: the recording has started again, or the cloud is not of it"
                 : "this machine's clock: synchronize the clocks (chrony, ntp)");
  } else {
    text << "; the transforms come late: check their publisher, or raise tf_wait (now "
         << limits_.tf_wait_s << " s)";
  }
  return text.str();
}

bool CloudQueue::hasReady() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return std::any_of(sources_.begin(), sources_.end(),
                     [](const Source& source) { return !source.ready.empty(); });
}

std::size_t CloudQueue::size() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::size_t count = 0;
  for (const Source& source : sources_) count += source.waiting.size() + source.ready.size();
  return count;
}

std::string CloudQueue::whyWaiting() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  const Entry* oldest = nullptr;
  for (const Source& source : sources_) {
    if (source.waiting.empty()) continue;
    const Entry& first = source.waiting.front();
    if (oldest == nullptr || first.arrival_s < oldest->arrival_s) oldest = &first;
  }
  if (oldest == nullptr) return {};
  return "frame '" + oldest->header().frame_id + "': " + describeCause(*oldest);
}

}  // namespace cuboid_mapping_ros
