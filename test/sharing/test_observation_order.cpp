// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/sharing/observation_order.h"

#include "support/failing_allocation.h"
#include "support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <deque>
#include <new>
#include <set>

namespace cuboid_mapping {
namespace {

using test::Random;
using test::seedNote;

RobotObservation makeObservation(const std::string& robot, std::uint64_t sequence, double stamp_s,
                                 std::uint64_t session = 1) {
  RobotObservation observation;
  observation.robot = robot;
  observation.session = session;
  observation.sequence = sequence;
  observation.stamp_ns = static_cast<std::int64_t>(1e9 * stamp_s);
  return observation;
}

std::tuple<std::int64_t, std::string, std::uint64_t, std::uint64_t> keyOf(
    const RobotObservation& observation) {
  return {observation.stamp_ns, observation.robot, observation.session, observation.sequence};
}

TEST(SequenceSet, isThatOfAStandardSet) {
  for (std::size_t i = 0; i < 200; ++i) {
    Random random(i);
    SequenceSet set;
    std::set<std::uint64_t> model;
    const int last = random.integer(1, 60);
    for (int j = 0; j < 60; ++j) {
      const auto sequence = static_cast<std::uint64_t>(random.integer(1, last));
      EXPECT_EQ(set.add(sequence), model.insert(sequence).second) << seedNote(i);
      EXPECT_EQ(set.newest(), *model.rbegin()) << seedNote(i);
      EXPECT_EQ(set.numMissing(), *model.rbegin() - model.size()) << seedNote(i);
      const auto after = static_cast<std::uint64_t>(random.integer(0, 70));
      std::uint64_t missing = after + 1;
      while (model.count(missing) > 0) ++missing;
      EXPECT_EQ(set.firstMissing(after), missing) << seedNote(i);
    }
  }
}

TEST(SequenceSet, takesRunsThatAreApartAndInOrder) {
  SequenceSet set;
  EXPECT_TRUE(set.setRuns({{1, 3}, {5, 5}}));
  EXPECT_EQ(set.count(), 4U);
  EXPECT_EQ(set.firstMissing(0), 4U);
  EXPECT_FALSE(set.add(5));
  EXPECT_FALSE(set.setRuns({{0, 3}})) << "sequences begin at 1";
  EXPECT_FALSE(set.setRuns({{4, 3}}));
  EXPECT_FALSE(set.setRuns({{1, 3}, {4, 6}})) << "would be one run";
  EXPECT_FALSE(set.setRuns({{1, 5}, {3, 6}}));
  EXPECT_EQ(set.count(), 4U) << "as before";
}

TEST(ObservationOrder, GoesOnInAnotherProgramWithWhatIsInTheMap) {
  ObservationOrder before(1.0);
  for (const std::uint64_t sequence : {1U, 2U, 4U}) {
    before.put(makeObservation("a", sequence, 0.1 * static_cast<double>(sequence)), 0.0);
  }
  before.put(makeObservation("b", 1, 10.0), 0.0);
  const std::vector<RobotObservation> due = before.takeDue(0.0);
  ASSERT_EQ(due.size(), 3U);
  before.noteApplied(due[0]);
  before.noteApplied(due[1]);  // The program ends before the third, and before b's was due.

  ObservationOrder after(1.0);
  after.start(before.progress(), 100.0);
  EXPECT_EQ(after.counts().num_received, 2U);
  std::vector<ObservationQuestion> questions = after.findQuestions(100.0);
  ASSERT_EQ(questions.size(), 2U);
  EXPECT_EQ(questions[0].robot, "a");
  EXPECT_EQ(questions[0].first, 3U);
  EXPECT_EQ(questions[1].robot, "b");
  EXPECT_EQ(questions[1].first, 1U);
  EXPECT_FALSE(after.put(makeObservation("a", 2, 0.2), 102.0)) << "is in the map";
  EXPECT_TRUE(after.put(makeObservation("a", 4, 0.4), 102.0));
  EXPECT_TRUE(after.put(makeObservation("a", 3, 0.3), 102.0));
  EXPECT_TRUE(after.put(makeObservation("b", 1, 10.0), 102.0));
  EXPECT_TRUE(after.takeDue(102.0).empty()) << "robots may have more to tell";
  after.noteAnswered(questions[0], 4);
  after.noteAnswered(questions[1], 1);
  questions = after.findQuestions(102.0);
  ASSERT_EQ(questions.size(), 2U);
  EXPECT_EQ(questions[0].first, 5U);
  after.noteAnswered(questions[0], 4);
  EXPECT_TRUE(after.takeDue(102.0).empty()) << "b may have more to tell";
  after.noteAnswered(questions[1], 0);  // It was restarted.
  EXPECT_TRUE(after.findQuestions(102.0).empty());
  const std::vector<RobotObservation> left = after.takeDue(102.0);
  ASSERT_EQ(left.size(), 2U);
  EXPECT_EQ(left[0].sequence, 3U);
  EXPECT_EQ(left[1].sequence, 4U);
  EXPECT_EQ(after.counts().num_late, 0U);
}

TEST(ObservationOrder, WaitsTenSecondsForRobotsThatDoNotAnswer) {
  ObservationOrder before(1.0);
  before.put(makeObservation("a", 1, 0.1), 0.0);
  for (const RobotObservation& observation : before.takeDue(5.0)) before.noteApplied(observation);
  ObservationOrder after(1.0);
  after.start(before.progress(), 100.0);
  after.put(makeObservation("b", 1, 20.0), 100.0);
  EXPECT_TRUE(after.takeDue(109.0).empty());
  EXPECT_EQ(after.takeDue(111.0).size(), 1U);
}

/// A robot that keeps its sent observations, and messages on their way.
class Network {
 public:
  Network(Random& random, double loss, double repetition, double max_delay_s)
      : random_(random), loss_(loss), repetition_(repetition), max_delay_s_(max_delay_s) {}

  void send(const RobotObservation& observation, double now_s, bool may_be_lost) {
    kept_.push_back(observation);
    if (may_be_lost && random_.chance(loss_)) return;
    travel(observation, now_s);
    if (random_.chance(repetition_)) travel(observation, now_s);
  }

  void arrive(ObservationOrder& order, double now_s) {
    while (!travelling_.empty() && travelling_.begin()->first <= now_s) {
      order.put(travelling_.begin()->second, now_s);
      travelling_.erase(travelling_.begin());
    }
  }

  void answer(ObservationOrder& order, double now_s) {
    for (const ObservationQuestion& question : order.findQuestions(now_s)) {
      std::uint64_t complete_to = 0;
      for (const RobotObservation& observation : kept_) {
        if (observation.robot != question.robot || observation.session != question.session)
          continue;
        if (observation.sequence >= question.first) order.put(observation, now_s);
        complete_to = std::max(complete_to, observation.sequence);
      }
      order.noteAnswered(question, complete_to);
    }
  }

  [[nodiscard]] const std::vector<RobotObservation>& sent() const { return kept_; }

 private:
  void travel(const RobotObservation& observation, double now_s) {
    travelling_.emplace(now_s + random_.real(0.0, max_delay_s_), observation);
  }

  Random& random_;
  double loss_;
  double repetition_;
  double max_delay_s_;
  std::vector<RobotObservation> kept_;
  std::multimap<double, RobotObservation> travelling_;
};

/// Eight robots at 10 Hz, one of which restarts; a fifth of the messages is lost, a fifth comes twice, all
/// take up to 2 s.
TEST(ObservationOrder, whatIsLostRepeatedAndDelayedComesOutOnceAndInOrder) {
  constexpr double kDelay_s = 4.0;
  for (std::size_t i = 0; i < 20; ++i) {
    Random random(i);
    Network network(random, 0.2, 0.2, 2.0);
    ObservationOrder order(kDelay_s);
    std::vector<RobotObservation> given;
    for (int tick = 0; tick < 400; ++tick) {
      const double now_s = 0.1 * tick;
      for (int robot = 0; robot < 8 && tick < 200; ++robot) {
        const bool is_restarted = robot == 3 && tick >= 100;
        const auto sequence = static_cast<std::uint64_t>(is_restarted ? tick - 99 : tick + 1);
        // A session that has ended cannot be asked: its last second arrives.
        const bool may_be_lost = robot != 3 || tick < 90 || tick >= 100;
        network.send(makeObservation("robot" + std::to_string(robot), sequence,
                                     now_s + 0.01 * robot, is_restarted ? 2 : 1),
                     now_s, may_be_lost);
      }
      network.arrive(order, now_s);
      network.answer(order, now_s);
      for (RobotObservation& observation : order.takeDue(now_s)) given.push_back(observation);
    }
    std::vector<RobotObservation> all = network.sent();
    std::sort(all.begin(), all.end(),
              [](const auto& a, const auto& b) { return keyOf(a) < keyOf(b); });
    const MergeCounts counts = order.counts();
    EXPECT_EQ(given.size(), all.size()) << seedNote(i);
    EXPECT_EQ(counts.num_missing, 0U) << seedNote(i);
    EXPECT_TRUE(std::is_sorted(given.begin(), given.end(), [](const auto& a, const auto& b) {
      return keyOf(a) < keyOf(b);
    })) << seedNote(i);
    EXPECT_EQ(counts.num_late, 0U);
    EXPECT_GT(counts.num_repeated, 100U);
    EXPECT_EQ(counts.num_waiting, 0U);
    EXPECT_EQ(counts.num_sessions, 9U);
  }
}

TEST(ObservationOrder, givesOutWhatIsOldEnoughAndAllAfterSilence) {
  ObservationOrder order(2.0);
  order.put(makeObservation("a", 1, 10.0), 0.0);
  order.put(makeObservation("a", 2, 11.0), 1.0);
  EXPECT_TRUE(order.takeDue(1.5).empty());
  order.put(makeObservation("b", 1, 12.5), 2.0);
  EXPECT_EQ(order.takeDue(2.0).size(), 1U);
  EXPECT_TRUE(order.takeDue(3.9).empty());
  EXPECT_EQ(order.takeDue(4.0).size(), 2U);
}

TEST(ObservationOrder, whatComesTooLateIsGivenOutAndCounted) {
  ObservationOrder order(1.0);
  order.put(makeObservation("a", 1, 10.0), 0.0);
  order.put(makeObservation("a", 2, 20.0), 0.1);
  EXPECT_EQ(order.takeDue(0.1).size(), 1U);
  RobotObservation late = makeObservation("b", 1, 5.0);
  late.left_out = 3;
  order.put(late, 0.2);
  EXPECT_EQ(order.takeDue(0.2).size(), 1U);
  EXPECT_EQ(order.counts().num_late, 1U);
  EXPECT_EQ(order.counts().late_robot, "b");
  EXPECT_NEAR(order.counts().late_s, 15.0, 1e-6);
  EXPECT_EQ(order.counts().num_left_out, 3U);
}

TEST(ObservationOrder, asksForGapsUntilTheRobotHasAnswered) {
  ObservationOrder order(1.0);
  order.put(makeObservation("a", 4, 1.0), 0.0);
  auto questions = order.findQuestions(0.1);
  ASSERT_EQ(questions.size(), 1U);
  EXPECT_EQ(questions[0].first, 1U) << "it joined late";
  order.put(makeObservation("a", 2, 0.5), 0.2);
  order.noteAnswered(questions[0], 4);
  EXPECT_TRUE(order.findQuestions(0.3).empty()) << "1 and 3 are not to be had";
  EXPECT_EQ(order.counts().num_missing, 2U);
  EXPECT_TRUE(order.put(makeObservation("a", 3, 0.7), 0.4)) << "it was on its way";
  EXPECT_EQ(order.counts().num_missing, 1U);
  questions = order.findQuestions(2.0);
  ASSERT_EQ(questions.size(), 1U) << "silent: is there more?";
  EXPECT_EQ(questions[0].first, 5U);
  order.put(makeObservation("a", 1, 9.0, 2), 2.1);
  EXPECT_TRUE(order.findQuestions(2.2).empty()) << "restarted: the old session cannot be asked";
}

TEST(ObservationOrder, followsARobotThatRestartsWithAnOlderClock) {
  ObservationOrder order(3.0);
  for (std::uint64_t i = 1; i <= 5; ++i) {
    order.put(makeObservation("a", i, 1000.0 + static_cast<double>(i), 1000000), 100.0);
  }
  EXPECT_EQ(order.takeDue(110.0).size(), 5U);
  for (const std::uint64_t i : {1U, 2U, 4U, 5U}) {
    order.put(makeObservation("a", i, 500.0 + static_cast<double>(i), 500000), 110.0);
  }
  const auto questions = order.findQuestions(110.5);
  ASSERT_EQ(questions.size(), 1U);
  EXPECT_EQ(questions[0].session, 500000U);
  EXPECT_EQ(questions[0].first, 3U);
  EXPECT_EQ(order.takeDue(120.0).size(), 4U);
  EXPECT_EQ(order.counts().num_late, 0U);
}

TEST(ObservationOrder, goesOnAfterAnyAllocationThatFails) {
  const std::string name = "a robot whose name does not fit into a string without an allocation";
  bool has_failed = true;
  for (long number = 0; has_failed; ++number) {
    ObservationOrder order(1.0);
    order.put(makeObservation("b", 2, 10.0), 0.0);
    RobotObservation first = makeObservation(name, 1, 10.0);
    try {
      const test::FailingAllocation failing(number);
      order.put(std::move(first), 0.0);
      has_failed = false;
    } catch (const std::bad_alloc&) {
    }
    EXPECT_EQ(order.findQuestions(0.1).size(), 1U) << "of b, after allocation " << number;
    EXPECT_EQ(order.put(makeObservation(name, 1, 10.0), 0.1), has_failed);
    EXPECT_EQ(order.takeDue(9.0).size(), 2U);
    EXPECT_EQ(order.counts().num_late, 0U);
  }
}

}  // namespace
}  // namespace cuboid_mapping
