// SPDX-License-Identifier: BSD-3-Clause
#include "mpi/cloud_parts.h"

#include "support/random_bricks.h"

#include <gtest/gtest.h>

#include <stdexcept>

namespace cuboid_mapping_ros {
namespace {

using cuboid_mapping::BrickMask;
using cuboid_mapping::BrickUpdate;
using cuboid_mapping::Cell;
using cuboid_mapping::Grid;
using cuboid_mapping::kBrickEdge;
using cuboid_mapping::ScanUpdate;
using cuboid_mapping::test::Random;

ScanUpdate randomCloud(Random& random) {
  ScanUpdate update = cuboid_mapping::test::randomUpdate(random, {{-9, -9, -9}, {9, 9, 9}}, 40);
  for (BrickUpdate& brick : update.bricks) {
    if (random.chance(0.3)) brick.grazes = BrickMask::all();
    if (random.chance(0.1)) std::swap(brick.misses, brick.grazes);
  }
  return update;
}

void expectSame(const std::vector<BrickUpdate>& read, const std::vector<BrickUpdate>& written,
                const std::string& note) {
  ASSERT_EQ(read.size(), written.size()) << note;
  for (std::size_t i = 0; i < read.size(); ++i) {
    const BrickUpdate& brick = written[i];
    EXPECT_EQ(read[i].brick, brick.brick) << note;
    EXPECT_EQ(read[i].hits, brick.hits) << note;
    EXPECT_EQ(read[i].misses, brick.misses.without(brick.hits)) << note;
    EXPECT_EQ(read[i].grazes, brick.grazes.without(brick.hits | brick.misses)) << note;
  }
}

void write(const ScanUpdate& update, std::size_t source, PartWriter& writer) {
  writer.beginCloud(source);
  for (const BrickUpdate& brick : update.bricks) writer.add(brick);
}

TEST(CloudParts, AreReadAsTheyWereWrittenOneBehindTheOther) {
  PartWriter writer;
  std::vector<BrickUpdate> read;
  for (int i = 0; i < 200; ++i) {
    Random random(static_cast<std::uint64_t>(i));
    writer.clear();
    std::vector<ScanUpdate> clouds(static_cast<std::size_t>(random.integer(1, 5)));
    for (std::size_t source = 0; source < clouds.size(); ++source) {
      if (random.chance(0.8)) clouds[source] = randomCloud(random);
      write(clouds[source], source, writer);
    }
    PartReader reader(writer.bytes());
    for (std::size_t source = 0; source < clouds.size(); ++source) {
      ASSERT_FALSE(reader.isAtEnd());
      EXPECT_EQ(reader.read(read), source);
      expectSame(read, clouds[source].bricks, cuboid_mapping::test::seedNote(i));
    }
    EXPECT_TRUE(reader.isAtEnd());
  }
}

TEST(CloudParts, ReachFromOneEndOfAMapToTheOther) {
  constexpr std::int32_t kMax = Grid::kMaxCell / kBrickEdge * kBrickEdge - kBrickEdge;
  ScanUpdate update;
  for (const Cell& brick : {Cell{-kMax, kMax, 0}, Cell{kMax, -kMax, kMax}, Cell{0, 0, -kMax}}) {
    update.bricks.push_back({brick, {}, BrickMask::all()});
  }
  PartWriter writer;
  write(update, 0, writer);
  std::vector<BrickUpdate> read;
  (void)PartReader(writer.bytes()).read(read);
  expectSame(read, update.bricks, "");
}

TEST(CloudParts, ThatAreCutOffAreRefused) {
  Random random(7);
  PartWriter writer;
  write(randomCloud(random), 3, writer);
  const std::string_view bytes = writer.bytes();
  std::vector<BrickUpdate> read;
  for (std::size_t size = 1; size < bytes.size(); ++size) {
    EXPECT_THROW(PartReader(bytes.substr(0, size)).read(read), std::runtime_error) << size;
  }
}

}  // namespace
}  // namespace cuboid_mapping_ros
