// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/occupancy/sensor_model.h"
#include "cuboid_mapping/scan/brick_update.h"

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <tuple>
#include <vector>

namespace cuboid_mapping {

/// The observation of one cloud of one robot.
struct RobotObservation {
  std::string robot;
  std::uint64_t session = 0;   ///< Session of the robot's node: another one after a restart.
  std::uint64_t sequence = 0;  ///< In its session: 1, 2, 3, ...
  std::uint64_t left_out =
      0;  ///< Clouds of its session so far that were not sent for want of bandwidth.
  std::int64_t stamp_ns = 0;  ///< Stamp of the cloud.
  SensorModelConfig sensor_model;
  ScanUpdate update;
};

/// Sequence numbers that have come, in any order.
class SequenceSet {
 public:
  /// @return Whether it is new. @pre sequence > 0. @complexity O(log n) for n gaps.
  bool add(std::uint64_t sequence);
  /// The greatest that has come; 0 when none has.
  [[nodiscard]] std::uint64_t newest() const;
  /// Missing sequences below newest().
  [[nodiscard]] std::uint64_t numMissing() const { return newest() - count_; }
  /// The least above `after` that has not come.
  [[nodiscard]] std::uint64_t firstMissing(std::uint64_t after) const;
  /// First and last of each run of sequences without a gap, in order.
  [[nodiscard]] const std::map<std::uint64_t, std::uint64_t>& runs() const { return last_of_; }
  [[nodiscard]] std::uint64_t count() const { return count_; }
  /// Puts runs in the place of all. @return false, and nothing happens, if they are not in order, or touch.
  bool setRuns(const std::map<std::uint64_t, std::uint64_t>& runs);

 private:
  std::map<std::uint64_t, std::uint64_t> last_of_;  ///< By first: runs that are apart.
  std::uint64_t count_ = 0;
};

/// Observations to ask a robot for: sequences from `first` on.
struct ObservationQuestion {
  std::string robot;
  std::uint64_t session = 0;
  std::uint64_t first = 0;
};

/// The observations in a map of several robots.
struct MergeProgress {
  struct Session {
    std::string robot;
    std::uint64_t session = 0;
    std::uint64_t left_out = 0;  ///< Clouds that the robot did not send.
    SequenceSet applied;
  };
  std::vector<Session> sessions;
  std::int64_t newest_stamp_ns = 0;  ///< Newest stamp of all of them.
};

/// Counts so far.
struct MergeCounts {
  std::uint64_t num_received = 0;  ///< Each once.
  std::uint64_t num_repeated = 0;  ///< Had come before, and were left out.
  std::uint64_t num_late = 0;      ///< Were given out behind later ones.
  std::uint64_t num_missing = 0;   ///< Have not come, though later ones of their session have.
  std::uint64_t num_left_out = 0;  ///< Clouds that robots have left out for want of bandwidth.
  std::uint64_t num_waiting = 0;   ///< Have come, and are not given out yet.
  std::uint64_t num_sessions = 0;  ///< Sessions of all robots.
};

/// Puts observations of several robots into one order: by stamp, then robot, session and sequence.
///
/// An observation waits until one has come whose stamp is `delay` later, or until nothing has come for
/// `delay`. Then it is given out. So all that arrive within `delay` of the newest stamp come out in order, whatever order
/// they arrive in; one that comes later is given out at once, and counted. Times are of any clock that does
/// not jump. Not thread-safe.
class ObservationOrder {
 public:
  explicit ObservationOrder(double delay_s) : delay_s_(delay_s) {}

  /// Takes an observation. @return false for one that has come before. @pre sequence > 0.
  bool put(RobotObservation observation, double now_s);

  /// Observations to apply now, in this order.
  [[nodiscard]] std::vector<RobotObservation> takeDue(double now_s);

  /// Observations that seem to be lost: gaps, and those after the last one of a robot that has been
  /// silent for a second.
  [[nodiscard]] std::vector<ObservationQuestion> findQuestions(double now_s) const;
  /// The robot has sent what it still has, up to and including this sequence: it is not asked again for what is missing
  /// there. Should it come nevertheless, it is taken. With 0, it has nothing of this session any more.
  void noteAnswered(const ObservationQuestion& question, std::uint64_t complete_to);

  [[nodiscard]] MergeCounts counts() const;

  /// To be called when the map has changed by an observation that was given out.
  void noteApplied(const RobotObservation& observation);
  /// The observations in the map. Saved with the map, another program goes on with both: start().
  [[nodiscard]] MergeProgress progress() const;
  /// Begins where another program has stopped: what it had not applied is asked for. Until all robots have
  /// answered, for ten seconds at most, nothing is given out: their answers would be in no order.
  /// @pre Nothing has come yet.
  void start(const MergeProgress& progress, double now_s);

 private:
  using Key = std::tuple<std::int64_t, std::string, std::uint64_t, std::uint64_t>;
  struct Session {
    SequenceSet received;
    SequenceSet applied;
    std::uint64_t left_out = 0;
    std::uint64_t asked_to = 0;  ///< Observations missing up to here are lost for good.
    double last_received_s = 0.0;
  };

  double delay_s_;
  std::map<Key, RobotObservation> waiting_;
  std::map<std::pair<std::string, std::uint64_t>, Session> sessions_;
  std::set<std::pair<std::string, std::uint64_t>> behind_;  ///< Have more to tell since start().
  double start_s_ = 0.0;
  std::map<std::string, std::uint64_t>
      newest_session_;  ///< By robot: it cannot be asked for others.
  Key last_given_;
  bool has_given_ = false;
  std::int64_t newest_stamp_ns_ = 0;
  std::int64_t newest_applied_ns_ = 0;
  double last_received_s_ = 0.0;
  MergeCounts counts_;
};

}  // namespace cuboid_mapping
