// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/sharing/observation_order.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace cuboid_mapping {
namespace {

constexpr double kSilence_s = 1.0;
/// Time for robots to send their observations from before start().
constexpr double kPatience_s = 10.0;

}  // namespace

bool SequenceSet::add(std::uint64_t sequence) {
  if (contains(sequence)) return false;
  const auto next = last_of_.upper_bound(sequence);
  const auto before = next == last_of_.begin() ? last_of_.end() : std::prev(next);
  const bool follows = before != last_of_.end() && before->second + 1 == sequence;
  const bool precedes = next != last_of_.end() && next->first == sequence + 1;
  if (follows) {
    before->second = precedes ? next->second : sequence;
    if (precedes) last_of_.erase(next);
  } else if (precedes) {
    auto run = last_of_.extract(next);
    run.key() = sequence;
    last_of_.insert(std::move(run));
  } else {
    last_of_.emplace(sequence, sequence);
  }
  ++count_;
  return true;
}

bool SequenceSet::contains(std::uint64_t sequence) const {
  const auto next = last_of_.upper_bound(sequence);
  return next != last_of_.begin() && sequence <= std::prev(next)->second;
}

std::uint64_t SequenceSet::newest() const {
  return last_of_.empty() ? 0 : std::prev(last_of_.end())->second;
}

std::uint64_t SequenceSet::firstMissing(std::uint64_t after) const {
  const auto next = last_of_.upper_bound(after + 1);
  if (next == last_of_.begin()) return after + 1;
  return std::max(after, std::prev(next)->second) + 1;
}

bool SequenceSet::setRuns(const std::map<std::uint64_t, std::uint64_t>& runs) {
  std::uint64_t end = 0;  // 0 is no sequence: the first run may begin at 1.
  std::uint64_t count = 0;
  for (const auto& [first, last] : runs) {
    const bool is_apart = end == 0 ? first > 0 : first > end + 1;
    if (!is_apart || last < first) return false;
    end = last;
    count += last - first + 1;
  }
  last_of_ = runs;
  count_ = count;
  return true;
}

bool ObservationOrder::put(RobotObservation observation, double now_s) {
  const auto [found, is_new] = sessions_.try_emplace({observation.robot, observation.session});
  Session& session = found->second;
  if (is_new && last_session_.count(observation.robot) > 0) {
    const auto delay_ns = static_cast<std::int64_t>(1e9 * delay_s_);
    const std::int64_t late_ns = newest_stamp_ns_ - observation.stamp_ns;
    if (late_ns > delay_ns) session.offset_ns = late_ns + 1;
  }
  if (session.received.contains(observation.sequence)) {
    ++counts_.num_repeated;
    return false;
  }
  const std::int64_t stamp_ns = observation.stamp_ns + session.offset_ns;
  const Key key{stamp_ns, observation.robot, observation.session, observation.sequence};
  std::uint64_t& last_session = last_session_[observation.robot];
  const std::uint64_t left_out = observation.left_out;
  const auto waiting = waiting_.emplace(key, std::move(observation)).first;
  try {
    session.received.add(std::get<3>(key));
  } catch (...) {
    waiting_.erase(waiting);  // The robot sends it again.
    throw;
  }
  last_session = std::get<2>(key);
  session.last_received_s = now_s;
  session.left_out = std::max(session.left_out, left_out);
  newest_stamp_ns_ = counts_.num_received == 0 ? stamp_ns : std::max(newest_stamp_ns_, stamp_ns);
  last_received_s_ = now_s;
  ++counts_.num_received;
  return true;
}

std::vector<RobotObservation> ObservationOrder::takeDue(double now_s) {
  if (!behind_.empty() && now_s - start_s_ < kPatience_s) return {};
  const auto delay_ns = static_cast<std::int64_t>(1e9 * delay_s_);
  const bool is_silent = now_s - last_received_s_ >= delay_s_;
  const auto end = std::find_if(waiting_.begin(), waiting_.end(), [&](const auto& waiting) {
    return !is_silent && std::get<0>(waiting.first) > newest_stamp_ns_ - delay_ns;
  });
  std::vector<RobotObservation> due;
  if (end == waiting_.begin()) return due;
  due.reserve(static_cast<std::size_t>(std::distance(waiting_.begin(), end)));
  MergeCounts counts = counts_;
  for (auto late = waiting_.begin(); late != end; ++late) {
    if (!has_given_ || !(late->first < last_given_)) break;
    ++counts.num_late;
    counts.late_robot = late->second.robot;
    counts.late_s = 1e-9 * static_cast<double>(newest_stamp_ns_ - std::get<0>(late->first));
  }
  Key last = std::prev(end)->first;  // Nothing throws from here on.
  counts_ = std::move(counts);
  for (auto next = waiting_.begin(); next != end; next = waiting_.erase(next)) {
    due.push_back(std::move(next->second));
  }
  if (!has_given_ || last_given_ < last) last_given_.swap(last);
  has_given_ = true;
  return due;
}

std::vector<ObservationQuestion> ObservationOrder::findQuestions(double now_s) const {
  std::vector<ObservationQuestion> questions;
  for (const auto& [name, session] : sessions_) {
    const auto last = last_session_.find(name.first);  // put() may have failed in between.
    if (last == last_session_.end() || last->second != name.second) continue;
    const std::uint64_t first = session.received.firstMissing(session.asked_to);
    const bool is_gap = first < session.received.newest();
    if (is_gap || behind_.count(name) > 0 || now_s - session.last_received_s >= kSilence_s) {
      questions.push_back({name.first, name.second, first});
    }
  }
  return questions;
}

void ObservationOrder::noteAnswered(const ObservationQuestion& question,
                                    std::uint64_t complete_to) {
  if (complete_to < question.first) behind_.erase({question.robot, question.session});
  const auto session = sessions_.find({question.robot, question.session});
  if (session == sessions_.end()) return;
  session->second.asked_to = std::max(session->second.asked_to, complete_to);
}

void ObservationOrder::noteApplied(const RobotObservation& observation) {
  sessions_[{observation.robot, observation.session}].applied.add(observation.sequence);
  newest_applied_ns_ = std::max(newest_applied_ns_, observation.stamp_ns);
}

MergeProgress ObservationOrder::progress() const {
  MergeProgress progress;
  progress.newest_stamp_ns = newest_applied_ns_;
  for (const auto& [name, session] : sessions_) {
    progress.sessions.push_back({name.first, name.second, session.left_out, session.applied});
  }
  return progress;
}

void ObservationOrder::start(const MergeProgress& progress, double now_s) {
  if (progress.sessions.empty()) return;
  newest_applied_ns_ = newest_stamp_ns_ = progress.newest_stamp_ns;
  last_given_ = {progress.newest_stamp_ns, "", 0, 0};
  has_given_ = true;
  last_received_s_ = now_s;
  for (const MergeProgress::Session& session : progress.sessions) {
    sessions_[{session.robot, session.session}] = {
        session.applied, session.applied, session.left_out, 0, now_s, 0};
    std::uint64_t& last_session = last_session_[session.robot];
    last_session = std::max(last_session, session.session);
    counts_.num_received += session.applied.count();
  }
  start_s_ = now_s;
  behind_.insert(last_session_.begin(), last_session_.end());
}

MergeCounts ObservationOrder::counts() const {
  MergeCounts counts = counts_;
  counts.num_waiting = waiting_.size();
  counts.num_sessions = sessions_.size();
  for (const auto& [name, session] : sessions_) {
    counts.num_missing += session.received.numMissing();
    counts.num_left_out += session.left_out;
  }
  return counts;
}

}  // namespace cuboid_mapping
