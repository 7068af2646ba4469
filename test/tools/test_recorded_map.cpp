// SPDX-License-Identifier: BSD-3-Clause
// map_convert on rosbags with the topics of a node: the map that a client had.
#include "cuboid_mapping/io/map_files.h"
#include "cuboid_mapping/map/map_snapshot.h"
#include "cuboid_mapping/ros/conversions/map_messages.h"
#include "support/snapshots.h"
#include "tools/run_program.h"

#include <gtest/gtest.h>
#include <rosbag/bag.h>
#include <std_msgs/String.h>

#include <fstream>

namespace cuboid_mapping_ros::test {
namespace {

using cuboid_mapping::ChangeSet;
using cuboid_mapping::CuboidMap;
using cuboid_mapping::MapDetail;
using cuboid_mapping::MapSnapshot;
using cuboid_mapping::VoxelBrick;
using cuboid_mapping::test::ProgramEnd;
using cuboid_mapping::test::Random;
using cuboid_mapping::test::runProgram;
using cuboid_mapping::test::TemporaryFolder;
using cuboid_mapping::test::voxelsOf;

/// A time after the start of a bag.
ros::Time timeAt(double time_s) { return ros::Time(1000.0) + ros::Duration(time_s); }

/// A node whose map changes with each step, and its messages.
class Server {
 public:
  Server(std::string name, std::uint64_t instance, unsigned seed)
      : random_(seed), name_(std::move(name)), instance_(instance) {}

  /// Adds a cloud of some voxels. @return The update.
  cuboid_mapping::CuboidMapUpdate step() {
    const ChangeSet changes =
        map_.apply(cuboid_mapping::test::randomUpdate(random_, {{-9, -4, -1}, {9, 4, 1}}, 60));
    DeltaMessage message;
    message.server = name_;
    message.delta = makeDelta(map_, changes, instance_, revision_, MapDetail::kValues);
    message.delta.label.frame_id = "map";
    revision_ = map_.revision();
    return toMessage(message);
  }

  [[nodiscard]] cuboid_mapping::FullCuboidMap keyframe() const { return toMessage(image()); }

  /// A part of a keyframe in two parts.
  [[nodiscard]] cuboid_mapping::FullCuboidMap part(std::uint32_t number) const {
    const ImageMessage whole = image();
    const VoxelBrick* first = whole.image.bricks.data();
    const VoxelBrick* middle = first + whole.image.bricks.size() / 2;
    const VoxelBrick* last = first + whole.image.bricks.size();
    auto message = number == 0 ? toMessage(whole, first, middle) : toMessage(whole, middle, last);
    message.part = number;
    message.num_parts = 2;
    return message;
  }

  [[nodiscard]] MapSnapshot snapshot() const { return takeSnapshot(map_, "map"); }

 private:
  [[nodiscard]] ImageMessage image() const {
    ImageMessage message;
    message.server = name_;
    message.image = makeImage(map_, instance_, MapDetail::kValues);
    message.image.label.frame_id = "map";
    return message;
  }

  Random random_;
  CuboidMap map_;
  std::string name_;
  std::uint64_t instance_;
  std::uint64_t revision_ = 0;
};

class RecordedMapTest : public testing::Test {
 protected:
  RecordedMapTest() { bag_.open(file_, rosbag::bagmode::Write); }

  template <typename MessageT>
  void write(double time_s, const MessageT& message, const std::string& topic) {
    bag_.write(topic, timeAt(time_s), message);
  }
  void writeKeyframe(double time_s, const cuboid_mapping::FullCuboidMap& message) {
    write(time_s, message, "/cuboid_map");
  }
  void writeUpdate(double time_s, const cuboid_mapping::CuboidMapUpdate& message) {
    write(time_s, message, "/cuboid_map_updates");
  }

  ProgramEnd convert(const std::vector<std::string>& options = {}) {
    bag_.close();
    std::vector<std::string> command{MAP_CONVERT_PROGRAM, file_, output_};
    command.insert(command.end(), options.begin(), options.end());
    return runProgram(command);
  }

  /// Expects the server's map of that time in the bag.
  void expectMap(const MapSnapshot& wanted, const std::vector<std::string>& options = {}) {
    const ProgramEnd end = convert(options);
    ASSERT_EQ(end.status, 0) << end.err;
    const MapSnapshot map = cuboid_mapping::readMapFile(output_).snapshot;
    EXPECT_EQ(map.frame_id, "map");
    EXPECT_EQ(map.resolution_m, wanted.resolution_m);
    ASSERT_FALSE(wanted.bricks.empty());
    EXPECT_TRUE(voxelsOf(map.bricks) == voxelsOf(wanted.bricks)) << end.err;
  }

  void expectError(const std::string& text, const std::vector<std::string>& options = {}) {
    const ProgramEnd end = convert(options);
    EXPECT_EQ(end.status, 1);
    EXPECT_NE(end.err.find(text), std::string::npos) << end.err;
    EXPECT_FALSE(std::filesystem::exists(output_));
  }

  TemporaryFolder folder_;
  std::string file_ = folder_ / "recorded.bag";
  std::string output_ = folder_ / "out.cuboids";
  rosbag::Bag bag_;
  Server server_{"/cuboid_mapping", 7, 1};
};

TEST_F(RecordedMapTest, HasTheMapOfEachTime) {
  std::vector<MapSnapshot> maps;
  writeUpdate(0.0, server_.step());
  writeKeyframe(0.5, server_.keyframe());
  for (int time_s = 1; time_s < 8; ++time_s) {
    writeUpdate(time_s, server_.step());
    maps.push_back(server_.snapshot());
  }
  expectMap(maps.back());
  for (const int time_s : {1, 4, 7}) {
    expectMap(maps.at(static_cast<std::size_t>(time_s) - 1), {"--at", std::to_string(time_s)});
  }
}

TEST_F(RecordedMapTest, BeginsWithTheFirstKeyframe) {
  (void)server_.step();
  for (const double time_s : {0.0, 1.0, 2.0}) writeUpdate(time_s, server_.step());
  writeKeyframe(2.5, server_.keyframe());
  writeUpdate(3.0, server_.step());
  expectMap(server_.snapshot());
  std::filesystem::remove(output_);
  expectError("the first whole map on /cuboid_map is at 2.5 s", {"--at", "2"});
}

TEST_F(RecordedMapTest, TakesUpdatesThatOvertakeTheirKeyframeOrItsParts) {
  writeUpdate(0.0, server_.step());
  const auto first = server_.part(0);
  const auto second = server_.part(1);
  writeUpdate(1.0, server_.step());
  writeKeyframe(1.1, first);
  writeUpdate(2.0, server_.step());
  writeKeyframe(2.1, second);
  expectMap(server_.snapshot());
}

TEST_F(RecordedMapTest, FollowsANodeThatIsStartedAnew) {
  writeUpdate(0.0, server_.step());
  writeKeyframe(0.5, server_.keyframe());
  Server again{"/cuboid_mapping", 8, 2};
  writeUpdate(1.0, again.step());
  writeKeyframe(1.5, again.keyframe());
  writeUpdate(2.0, again.step());
  expectMap(again.snapshot());
}

TEST_F(RecordedMapTest, IsOldAfterALostUpdateUntilTheNextKeyframe) {
  writeUpdate(0.0, server_.step());
  writeKeyframe(0.5, server_.keyframe());
  writeUpdate(1.0, server_.step());
  const MapSnapshot old = server_.snapshot();
  (void)server_.step();
  writeUpdate(3.0, server_.step());
  writeKeyframe(4.0, server_.keyframe());
  expectMap(server_.snapshot());
  expectMap(old, {"--at", "3.5"});
  const ProgramEnd end = convert({"--at", "3.5"});
  EXPECT_NE(end.err.find("an update was lost before 3 s"), std::string::npos) << end.err;
  EXPECT_EQ(convert().err.find("lost"), std::string::npos);
  EXPECT_EQ(convert().err.find("classes only"), std::string::npos);
}

TEST_F(RecordedMapTest, IsThatOfKeyframesWithoutUpdates) {
  (void)server_.step();
  writeKeyframe(0.0, server_.keyframe());
  (void)server_.step();
  writeKeyframe(1.0, server_.keyframe());
  expectMap(server_.snapshot());
}

TEST_F(RecordedMapTest, NamesTheTopicsOfABagWithoutMaps) {
  write(0.0, std_msgs::String(), "/talk");
  writeUpdate(1.0, server_.step());
  expectError(
      "It has: /cuboid_map_updates (cuboid_mapping/CuboidMapUpdate), /talk (std_msgs/String). "
      "bag_to_map makes a map of clouds");
}

TEST_F(RecordedMapTest, IsNotInAnEmptyBag) { expectError("It has: nothing"); }

TEST_F(RecordedMapTest, NeedsAChoiceOfTopics) {
  Server other{"/other/cuboid_mapping", 8, 2};
  (void)server_.step();
  (void)other.step();
  writeKeyframe(0.0, server_.keyframe());
  write(0.0, other.keyframe(), "/other/cuboid_map");
  write(1.0, other.step(), "/other/cuboid_map_updates");
  expectError("choose one with --topic: /cuboid_map, /other/cuboid_map");
  expectError("no map on /third, but on /cuboid_map, /other/cuboid_map", {"--topic", "third"});
  expectMap(other.snapshot(), {"--topic", "other/cuboid_map"});
  expectMap(server_.snapshot(), {"--topic", "/cuboid_map"});
}

TEST_F(RecordedMapTest, NeedsAChoiceOfNodesOnOneTopic) {
  Server other{"/other", 8, 2};
  writeUpdate(0.0, server_.step());
  writeUpdate(0.0, other.step());
  writeKeyframe(1.0, server_.keyframe());
  writeKeyframe(1.0, other.keyframe());
  writeUpdate(2.0, server_.step());
  writeUpdate(2.0, other.step());
  expectError(
      "several nodes publish /cuboid_map: /cuboid_mapping, /other: choose one with --server");
  expectError("nobody named /third published /cuboid_map, but /cuboid_mapping, /other",
              {"--server", "third"});
  expectMap(other.snapshot(), {"--server", "other"});
  expectMap(server_.snapshot(), {"--server", "/cuboid_mapping"});
}

TEST_F(RecordedMapTest, IsNotMadeOfPartsOnly) {
  (void)server_.step();
  writeKeyframe(0.0, server_.part(0));
  writeUpdate(1.0, server_.step());
  expectError("no map on /cuboid_map is whole: record for longer than keyframe_period");
}

TEST_F(RecordedMapTest, OfABagWithoutIndexIsRefusedWithACure) {
  for (int i = 0; i < 3; ++i) (void)server_.step();
  writeKeyframe(0.0, server_.keyframe());
  bag_.close();
  std::filesystem::resize_file(file_, std::filesystem::file_size(file_) / 2);
  expectError("rosbag reindex");
}

TEST_F(RecordedMapTest, GoesOnBehindDamage) {
  bag_.setCompression(rosbag::compression::BZ2);
  bag_.setChunkThreshold(1);  // A chunk for each message.
  writeUpdate(0.0, server_.step());
  writeKeyframe(0.5, server_.keyframe());
  const auto before = static_cast<std::streamoff>(bag_.getSize());
  writeUpdate(1.0, server_.step());
  const auto after = static_cast<std::streamoff>(bag_.getSize());
  writeUpdate(2.0, server_.step());
  writeKeyframe(2.5, server_.keyframe());
  bag_.close();
  ASSERT_GT(after - before, 1000);
  std::fstream(file_, std::ios::binary | std::ios::in | std::ios::out)
      .seekp((before + after) / 2)
      .write("damaged, damaged, damaged", 25);
  expectMap(server_.snapshot());
  EXPECT_NE(convert().err.find("is damaged: 1 message"), std::string::npos) << convert().err;
}

TEST_F(RecordedMapTest, OptionsOfBagsDoNotGoWithFiles) {
  (void)server_.step();
  (void)cuboid_mapping::writeMapFile(folder_ / "map.cuboids", server_.snapshot());
  const ProgramEnd end =
      runProgram({MAP_CONVERT_PROGRAM, folder_ / "map.cuboids", output_, "--at", "3"});
  EXPECT_EQ(end.status, 1);
  EXPECT_NE(end.err.find("are for rosbags"), std::string::npos) << end.err;
}

}  // namespace
}  // namespace cuboid_mapping_ros::test
