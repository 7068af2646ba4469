// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/middleware/tf_buffer.h"

#include "cuboid_mapping/io/text.h"
#include "cuboid_mapping/ros/middleware/names.h"
#include "cuboid_mapping/ros/middleware/tf_lookup.h"

#include <ros/console.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <sstream>
#include <stdexcept>
#include <utility>

namespace cuboid_mapping_ros {
namespace {

/// As many as clouds, with which transforms share a thread; the 100 of tf2_ros last a tenth of a second at 1 kHz.
constexpr std::uint32_t kTfQueueSize = 1000;

/// Why tf2 refuses a transform, with a line in the log each time; empty if it takes it.
std::string findFault(const geometry_msgs::TransformStamped& transform) {
  constexpr double kMaxError = 1e-3;  // tf2's own is larger.
  const std::string& parent = transform.header.frame_id;
  const std::string& child = transform.child_frame_id;
  if (parent.empty() || child.empty() || parent == child) {
    return "its frames are '" + parent + "' and '" + child + "'";
  }
  const auto& p = transform.transform.translation;
  const auto& q = transform.transform.rotation;
  if (!std::isfinite(p.x + p.y + p.z)) return "a translation is no number";
  const double length = std::sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w);
  if (std::abs(length - 1.0) <= kMaxError) return {};
  std::ostringstream text;
  text << "the rotation (" << q.x << ", " << q.y << ", " << q.z << ", " << q.w
       << ") is no unit quaternion";
  return text.str();
}

}  // namespace

bool TfBuffer::setTransform(const geometry_msgs::TransformStamped& transform,
                            const std::string& authority, bool is_static) {
  const geometry_msgs::TransformStamped tidy = tidyTransform(transform);
  if (is_static) return tf2::BufferCore::setTransform(tidy, authority, true);
  const std::lock_guard<std::mutex> lock(mutex_);
  Times& times = times_[tidy.child_frame_id];
  const double stamp_s = tidy.header.stamp.toSec();
  if (times.doubted) {
    const double doubted_s = times.doubted->header.stamp.toSec();
    if (stamp_s == doubted_s) return true;  // Its twin confirms nothing.
    const bool is_confirmed = std::abs(stamp_s - doubted_s) < std::abs(stamp_s - times.newest_s);
    if (is_confirmed) (void)insert(*times.doubted, authority, times);
    times.doubted.reset();
  }
  const bool leads = times.newest_s > 0.0 && stamp_s - times.newest_s > 0.5 * cache_s_;
  if (!leads) return insert(tidy, authority, times);
  times.doubted = tidy;
  return true;
}

bool TfBuffer::insert(const geometry_msgs::TransformStamped& transform,
                      const std::string& authority, Times& times) {
  if (!tf2::BufferCore::setTransform(transform, authority, false)) return false;
  noteTime(times, transform.header.stamp.toSec());
  return true;
}

void TfBuffer::clear() {
  tf2::BufferCore::clear();
  const std::lock_guard<std::mutex> lock(mutex_);
  times_.clear();
  faults_.clear();
}

std::optional<double> TfBuffer::delay_s(const geometry_msgs::TransformStamped& transform) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto times = times_.find(transform.child_frame_id);
  if (times == times_.end()) return std::nullopt;
  return times->second.newest_s - transform.header.stamp.toSec();
}

bool TfBuffer::covers(const std::string& frame_id, const ros::Time& stamp) const {
  constexpr double kMargin_s = 1.0;  // tf2's oldest one is younger than the time that it keeps.
  const std::lock_guard<std::mutex> lock(mutex_);
  const std::vector<std::string> frame_ids = findAncestors(*this, frame_id);
  return std::all_of(frame_ids.begin(), frame_ids.end(), [&](const std::string& name) {
    const auto times = times_.find(name);
    return times == times_.end() || (times->second.oldest_s + kMargin_s <= stamp.toSec() &&
                                     stamp.toSec() <= times->second.newest_s);
  });
}

void TfBuffer::noteFault(const std::string& frame_id, const std::string& fault) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (fault.empty()) {
    faults_.erase(frame_id);
  } else {
    faults_[frame_id] = fault;
  }
}

std::string TfBuffer::describeFaults(const std::string& frame_id) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (faults_.empty()) return {};
  std::string text;
  for (const std::string& ancestor : findAncestors(*this, frame_id)) {
    const auto fault = faults_.find(ancestor);
    if (fault == faults_.end()) continue;
    text.append(text.empty() ? "" : "; ").append("the transforms of '").append(ancestor);
    text.append("' are faulty: ").append(fault->second);
  }
  return text;
}

void TfBuffer::noteTime(Times& times, double stamp_s) const {
  std::map<double, double>& ends_s = times.gap_ends_s;
  const auto note_gap = [&](double begin_s, double end_s) {
    if (end_s - begin_s > max_gap_s_) ends_s[begin_s] = end_s;
  };
  if (times.newest_s == 0.0) times.oldest_s = times.newest_s = stamp_s;
  if (stamp_s >= times.newest_s) {
    note_gap(times.newest_s, stamp_s);
    times.newest_s = stamp_s;
    times.oldest_s = std::max(times.oldest_s, stamp_s - cache_s_);
    while (!ends_s.empty() && ends_s.begin()->second < times.oldest_s) ends_s.erase(ends_s.begin());
    return;
  }
  if (stamp_s < times.oldest_s) {
    note_gap(stamp_s, times.oldest_s);
    times.oldest_s = stamp_s;
    return;
  }
  // A late transform divides the gap that it lies in.
  const auto after = ends_s.upper_bound(stamp_s);
  if (after == ends_s.begin() || std::prev(after)->second < stamp_s) return;
  const auto [begin_s, end_s] = *std::prev(after);
  ends_s.erase(begin_s);
  note_gap(begin_s, stamp_s);
  note_gap(stamp_s, end_s);
}

std::optional<TfGap> TfBuffer::findGap(const std::string& target, const std::string& source,
                                       const ros::Time& stamp) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  const bool has_gaps = std::any_of(times_.begin(), times_.end(), [](const auto& item) {
    return !item.second.gap_ends_s.empty();
  });
  if (!has_gaps || stamp.isZero()) return std::nullopt;
  std::vector<std::string> frame_ids = findAncestors(*this, source);
  const std::vector<std::string> others = findAncestors(*this, target);
  // Frames of both play no part: the transforms above the last common one cancel out.
  for (const std::string& frame_id : others) {
    const auto same = std::find(frame_ids.begin(), frame_ids.end(), frame_id);
    same == frame_ids.end() ? frame_ids.push_back(frame_id) : (void)frame_ids.erase(same);
  }
  const double stamp_s = stamp.toSec();
  for (const std::string& frame_id : frame_ids) {
    const auto times = times_.find(frame_id);
    if (times == times_.end()) continue;
    const auto after = times->second.gap_ends_s.lower_bound(stamp_s);
    if (after == times->second.gap_ends_s.begin()) continue;
    const auto [begin_s, end_s] = *std::prev(after);
    if (stamp_s < end_s) return TfGap{frame_id, begin_s, end_s};
  }
  return std::nullopt;
}

TfReceiver::TfReceiver(ros::NodeHandle nh, TfBuffer& buffer)
    : buffer_(buffer), latest_(ros::Time::now()) {
  using Take = boost::function<void(const Event&)>;
  subscriber_ = nh.subscribe<tf2_msgs::TFMessage>(
      "/tf", kTfQueueSize, Take([this](const Event& event) { take(event, false); }));
  static_subscriber_ = nh.subscribe<tf2_msgs::TFMessage>(
      "/tf_static", kTfQueueSize, Take([this](const Event& event) { take(event, true); }));
}

void TfReceiver::take(const Event& event, bool is_static) {
  const ros::Time now = ros::Time::now();
  if (now.toSec() < latest_.toSec() - kMinJump_s) {
    ROS_WARN_NAMED(kNodeName, "time has jumped back by %.1f s: the tf buffer is cleared",
                   latest_.toSec() - now.toSec());
    buffer_.clear();
    moving_.clear();
    latest_ = now;
    settled_ = now + ros::Duration(kMinJump_s);
  }
  latest_ = std::max(latest_, now);
  for (const auto& given : event.getConstMessage()->transforms) {
    const geometry_msgs::TransformStamped transform = tidyTransform(given);
    const bool is_ahead = transform.header.stamp.toSec() > now.toSec() + kMinJump_s;
    // Of the run before a jump: tf would ignore those of this run, which are older.
    if (is_ahead && now < settled_ && !is_static) continue;
    try {
      std::string fault = findFault(transform);
      const auto delay_s = is_static ? std::nullopt : buffer_.delay_s(transform);
      if (fault.empty() && delay_s > buffer_.cache_s()) {
        fault = "its stamp is " + std::to_string(std::llround(*delay_s)) + " s behind the newest";
      }
      const bool is_refused = !fault.empty();
      if (is_refused) {
        fault += ". Correct " + event.getPublisherName();
      } else if (!is_static) {
        fault = noteParent(transform, event.getPublisherName());
      }
      buffer_.noteFault(transform.child_frame_id, fault);
      if (is_refused) throw std::runtime_error(fault);
      if (delay_s != 0.0) {  // tf2 keeps the first of twins.
        buffer_.setTransform(transform, event.getPublisherName(), is_static);
      }
      if (!is_static) {
        noteMove(transform, event.getPublisherName());
      } else if (const std::string warning = statics_.note(transform, event.getPublisherName());
                 !warning.empty()) {
        ROS_WARN_STREAM_NAMED(kNodeName, warning);
      }
    } catch (const std::runtime_error& exception) {
      // A fault, or of tf, or of ros::Time for stamps near its end.
      ROS_ERROR_STREAM_THROTTLE(10.0, "a transform of '" << transform.child_frame_id
                                                         << "' is ignored: " << exception.what());
    }
  }
}

std::string TfReceiver::noteParent(const geometry_msgs::TransformStamped& transform,
                                   const std::string& publisher) {
  constexpr std::size_t kMostChanges = 4;  // A frame may be handed over, such as a load.
  constexpr double kPause_s = 10.0;
  Moving& frame = moving_[transform.child_frame_id];
  const double stamp_s = transform.header.stamp.toSec();
  if (std::abs(stamp_s - frame.changed_s) > kPause_s) {
    frame.num_changes = 0;
    frame.parents.clear();
  }
  frame.parents[transform.header.frame_id] = publisher;
  if (std::exchange(frame.parent, transform.header.frame_id) != transform.header.frame_id) {
    frame.changed_s = stamp_s;
    ++frame.num_changes;
  }
  if (frame.num_changes <= kMostChanges) return {};
  std::vector<std::string> names;
  for (const auto& [parent, of] : frame.parents) {
    names.push_back("'" + std::string(parent).append("' (").append(of).append(")"));
  }
  return "they have different parents in turn, " + cuboid_mapping::join(names, " and ") +
         ", of which tf follows the last. Stop all but one";
}

void TfReceiver::noteMove(const geometry_msgs::TransformStamped& transform,
                          const std::string& publisher) {
  Moving& frame = moving_[transform.child_frame_id];
  const auto& position = transform.transform.translation;
  frame.jumps.add(Eigen::Vector3d(position.x, position.y, position.z));
  frame.publishers.insert(publisher);
  if (frame.is_said || !frame.jumps.isSeen()) return;
  frame.is_said = true;
  ROS_WARN_STREAM_NAMED(kNodeName, "'" << transform.child_frame_id
                                       << "' jumps to and fro between two places: its transforms "
                                          "are of two runs, robots or publishers ("
                                       << cuboid_mapping::join(frame.publishers, ", ")
                                       << "). Clouds between them are misplaced: stop one of them");
}

}  // namespace cuboid_mapping_ros
