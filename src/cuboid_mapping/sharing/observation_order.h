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
  std::uint64_t session = 0;   ///< Session of the robot's node; changes at a restart.
  std::uint64_t sequence = 0;  ///< Number in its session: 1, 2, 3, ...
  /// Clouds of its session so far that were not sent for lack of bandwidth.
  std::uint64_t left_out = 0;
  std::int64_t stamp_ns = 0;  ///< Stamp of the cloud.
  SensorModelConfig sensor_model;
  ScanUpdate update;
};

/// Sequence numbers that have arrived, in any order.
class SequenceSet {
 public:
  /// @return Whether it is new. @pre sequence > 0. @complexity O(log n) for n gaps.
  bool add(std::uint64_t sequence);
  /// Whether a sequence has arrived. @complexity O(log n).
  [[nodiscard]] bool contains(std::uint64_t sequence) const;
  /// Greatest sequence that has arrived; 0 if none has.
  [[nodiscard]] std::uint64_t newest() const;
  /// Missing sequences below newest().
  [[nodiscard]] std::uint64_t numMissing() const { return newest() - count_; }
  /// Least sequence above `after` that has not arrived.
  [[nodiscard]] std::uint64_t firstMissing(std::uint64_t after) const;
  /// First and last of each run of sequences without a gap, in order.
  [[nodiscard]] const std::map<std::uint64_t, std::uint64_t>& runs() const { return last_of_; }
  [[nodiscard]] std::uint64_t count() const { return count_; }
  /// Replaces all by runs. @return false, without a change, if they are not in order, or touch.
  bool setRuns(const std::map<std::uint64_t, std::uint64_t>& runs);

 private:
  std::map<std::uint64_t, std::uint64_t> last_of_;  ///< Last by first: runs with gaps between them.
  std::uint64_t count_ = 0;
};

/// Observations to request from a robot: sequences from `first` on.
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
  std::int64_t newest_stamp_ns = 0;  ///< Newest stamp of the observations.
};

/// Numbers so far.
struct MergeCounts {
  std::uint64_t num_received = 0;  ///< Received observations, each once.
  std::uint64_t num_repeated = 0;  ///< Repeated observations, which were left out.
  std::uint64_t num_late = 0;      ///< Observations released after later ones; the last one ...
  std::string late_robot;          ///< ... is of this robot, ...
  double late_s = 0.0;             ///< ... and by so much older than the newest one.
  std::uint64_t num_missing = 0;   ///< Missing observations before received ones.
  std::uint64_t num_left_out = 0;  ///< Clouds left out by robots for lack of bandwidth.
  std::uint64_t num_waiting = 0;   ///< Received observations not released yet.
  std::uint64_t num_sessions = 0;  ///< Sessions of all robots.
};

/// Puts observations of several robots into one order: by stamp, then robot, session and sequence.
///
/// An observation is released when another with a stamp `delay` later has arrived, or when none has arrived for
/// `delay`. So observations with stamps within `delay` of the newest one are released in order, whatever their
/// order of arrival; an older one is released at once, and counted as late. A robot that restarts with an older
/// clock goes on at the newest stamp. Times come from any clock that does not jump. Not thread-safe.
class ObservationOrder {
 public:
  explicit ObservationOrder(double delay_s) : delay_s_(delay_s) {}

  /// Adds an observation. @return false if it has come before. @pre sequence > 0.
  bool put(RobotObservation observation, double now_s);

  /// Observations to apply now, in this order.
  [[nodiscard]] std::vector<RobotObservation> takeDue(double now_s);

  /// Observations that may be lost: in gaps, and after the last one of a robot that has been silent for a
  /// second. At most one question for each robot.
  [[nodiscard]] std::vector<ObservationQuestion> findQuestions(double now_s) const;
  /// Notes that the robot has sent all that it still has, up to this sequence: missing observations up to there
  /// are not requested again, but accepted if they arrive. With 0, it has nothing of this session any more.
  void noteAnswered(const ObservationQuestion& question, std::uint64_t complete_to);

  [[nodiscard]] MergeCounts counts() const;

  /// Notes that a released observation is in the map.
  void noteApplied(const RobotObservation& observation);
  /// The observations in the map. Save it with the map, so that another program continues with both: start().
  [[nodiscard]] MergeProgress progress() const;
  /// Continues where another program has stopped: observations that it had not applied are requested. Until all
  /// robots have answered, or for ten seconds, nothing is released, since answers would be out of order.
  /// @pre No observation has arrived yet.
  void start(const MergeProgress& progress, double now_s);

 private:
  using Key = std::tuple<std::int64_t, std::string, std::uint64_t, std::uint64_t>;
  struct Session {
    SequenceSet received;
    SequenceSet applied;
    std::uint64_t left_out = 0;
    std::uint64_t asked_to = 0;  ///< Observations missing up to here are lost for good.
    double last_received_s = 0.0;
    std::int64_t offset_ns = 0;  ///< Time by which its robot has set back its clock, at a restart.
  };

  double delay_s_;
  std::map<Key, RobotObservation> waiting_;
  std::map<std::pair<std::string, std::uint64_t>, Session> sessions_;
  std::set<std::pair<std::string, std::uint64_t>> behind_;  ///< With more to send since start().
  double start_s_ = 0.0;
  /// Session heard last, by robot: others cannot be requested.
  std::map<std::string, std::uint64_t> last_session_;
  Key last_given_;
  bool has_given_ = false;
  std::int64_t newest_stamp_ns_ = 0;
  std::int64_t newest_applied_ns_ = 0;
  double last_received_s_ = 0.0;
  MergeCounts counts_;
};

}  // namespace cuboid_mapping
