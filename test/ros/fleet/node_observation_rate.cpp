// SPDX-License-Identifier: BSD-3-Clause
// Nodes that observe more than they may send.
#include "cuboid_mapping/Observation.h"
#include "ros/node_probe.h"
#include "support/random.h"

#include <ros/serialization.h>

#include <vector>

namespace cuboid_mapping_ros::test {
namespace {

using cuboid_mapping::Observation;
using cuboid_mapping::test::Random;

constexpr double kRate = 50e3;  ///< Bytes per second, as in the launch file.
constexpr int kSentClouds = 20;

/// Messages of one node.
class ObservationListener {
 public:
  explicit ObservationListener(const std::string& robot)
      : diagnostics_('/' + robot + "/cuboid_mapping", "observations") {
    const boost::function<void(const Observation::ConstPtr&)> take =
        [this](const Observation::ConstPtr& message) { received_.push_back(*message); };
    subscriber_ = nh_.subscribe('/' + robot + "/observations", 100, take);
  }

  [[nodiscard]] bool isConnected() const { return subscriber_.getNumPublishers() > 0; }
  [[nodiscard]] const std::vector<Observation>& received() const { return received_; }
  [[nodiscard]] long figure(const std::string& name) const {
    return diagnostics_.status().number(name);
  }
  /// Bytes of all messages but the last, which may be sent as soon as nothing is owed.
  [[nodiscard]] double numBytes() const {
    double num_bytes = 0.0;
    for (std::size_t i = 0; i + 1 < received_.size(); ++i) {
      num_bytes += ros::serialization::serializationLength(received_[i]);
    }
    return num_bytes;
  }

 private:
  ros::NodeHandle nh_;
  DiagnosticsProbe diagnostics_;
  ros::Subscriber subscriber_;
  std::vector<Observation> received_;
};

class ObservationRate : public ::testing::Test {
 protected:
  void publishCloud(int number) {
    std::vector<Eigen::Vector3d> points;
    for (int i = 0; i < 400; ++i) {
      const Eigen::Vector3d direction(random_.real(-1.0, 1.0), random_.real(-1.0, 1.0), 0.3);
      points.emplace_back(random_.real(4.0, 8.0) * direction.normalized());
    }
    cloud_.publish(makeCloud("map", ros::Time(100.0 + 0.1 * number), points));
  }

  static double now_s() { return ros::SteadyTime::now().toSec(); }

  ros::NodeHandle nh_;
  Random random_{7};
  ros::Publisher cloud_ = nh_.advertise<sensor_msgs::PointCloud2>("/cloud_in", 100);
};

TEST_F(ObservationRate, BoundsWhatIsSentAndTheRestComesLaterOrIsCounted) {
  ObservationListener later("later");
  ObservationListener thin("thin");
  publishStaticTf(makeTransform("map", "robot", Eigen::Isometry3d::Identity()));
  ASSERT_TRUE(waitFor([&] {
    return later.isConnected() && thin.isConnected() && cloud_.getNumSubscribers() == 2;
  }));
  ros::WallDuration(0.5).sleep();  // Lets the nodes connect, too.
  const double start_s = now_s();
  for (int i = 0; i < kSentClouds; ++i) {
    publishCloud(i);
    ros::WallDuration(0.05).sleep();
  }
  ASSERT_TRUE(waitFor([&] { return later.received().size() == kSentClouds; }))
      << later.received().size();
  const double time_s = now_s() - start_s;
  EXPECT_LE(later.numBytes(), kRate * (time_s + 1.0));
  EXPECT_GT(later.numBytes(), 3.0 * kRate) << "else nothing had to wait";
  for (int i = 0; i < kSentClouds; ++i) {
    EXPECT_EQ(later.received()[static_cast<std::size_t>(i)].sequence, i + 1U);
  }
  EXPECT_EQ(later.received().back().left_out, 0U);

  ASSERT_TRUE(waitFor([&] { return thin.figure("clouds left out") > 0; }));
  EXPECT_LT(thin.received().size(), kSentClouds);
  EXPECT_LE(thin.numBytes(), kRate * (now_s() - start_s + 1.0));
  ros::WallDuration(2.0).sleep();  // Waits until nothing is owed.
  publishCloud(kSentClouds);
  ASSERT_TRUE(waitFor([&] { return later.received().size() == kSentClouds + 1; }));
  ASSERT_TRUE(waitFor(
      [&] { return thin.received().back().header.stamp == later.received().back().header.stamp; }));
  EXPECT_EQ(thin.received().size(), thin.received().back().sequence);
  EXPECT_EQ(thin.received().back().sequence + thin.received().back().left_out, kSentClouds + 1U);
  EXPECT_TRUE(waitFor([&] {
    return thin.figure("clouds left out") == static_cast<long>(thin.received().back().left_out) &&
           later.figure("observations sent") == kSentClouds + 1;
  }));
}

}  // namespace
}  // namespace cuboid_mapping_ros::test
