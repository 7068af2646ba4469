// SPDX-License-Identifier: BSD-3-Clause
// Long work reports its progress, and can be cancelled.
#include "cuboid_mapping/io/file_replacement.h"
#include "cuboid_mapping/io/map_files.h"
#include "cuboid_mapping/map/map_edit.h"
#include "map_comparison.h"
#include "pictures/map_picture.h"
#include "pictures/picture_legend.h"
#include "support/snapshots.h"
#include "tools/run_program.h"

#include <gtest/gtest.h>

namespace cuboid_mapping {
namespace {

using test::Random;
using test::TemporaryFolder;

struct GivenUp {};

/// Expects that a listener gets all steps in order, and that an exception of the listener ends the
/// work, in the middle or at the start.
/// @param work  Does the work with a listener.
template <typename WorkT>
void expectProgress(const WorkT& work) {
  std::uint64_t last = 0;
  std::uint64_t of = 0;
  int num_calls = 0;
  work([&](std::uint64_t done, std::uint64_t total) {
    EXPECT_EQ(done == 0, num_calls == 0);
    EXPECT_GE(done, last);
    EXPECT_LE(done, total);
    last = done;
    of = total;
    ++num_calls;
  });
  EXPECT_GT(of, 0U);
  EXPECT_EQ(last, of);
  EXPECT_GT(num_calls, 1);
  const auto give_up_after = [&](std::uint64_t step) {
    EXPECT_THROW(work([=](std::uint64_t done, std::uint64_t /*total*/) {
                   if (done >= step) throw GivenUp();
                 }),
                 GivenUp);
  };
  give_up_after(0);
  give_up_after(1);
}

MapSnapshot makeOther() {
  Random random(81);
  return test::randomSnapshot(random);
}

TEST(Progress, isToldWhileMapsAreCompared) {
  const MapSnapshot snapshot = makeOther();
  expectProgress([&](const ProgressListener& listener) {
    EXPECT_TRUE(compareMaps(snapshot, snapshot, listener).isSameByClass());
  });
}

TEST(Progress, isToldWhileAPictureIsDrawnByAnyNumberOfThreads) {
  const MapSnapshot snapshot = makeOther();
  MapConfig config;
  config.resolution_m = snapshot.resolution_m;
  CuboidMap map(config);
  restoreSnapshot(snapshot, map);
  const PictureSize size{40, 30};
  const Camera camera = makeTopCamera(map, size);
  for (const int threads : {1, 3}) {
    expectProgress([&](const ProgressListener& listener) {
      const Picture picture = renderMap(map, camera, {}, size, threads, listener);
      EXPECT_EQ(picture.rgb, renderMap(map, camera, {}, size, 1).rgb);
    });
  }
}

TEST(MapPicture, showsWallsThatAreThinnerThanAPixel) {
  CuboidMap map(MapConfig{});
  const double edge_m = map.grid().resolution();
  const auto box = [edge_m](double y, double end_y, double height) {
    return MetricBox{Eigen::Vector3d(0.0, y, 0.0) * edge_m,
                     Eigen::Vector3d(1000.0, end_y, height) * edge_m};
  };
  fill(map, box(0.0, 1000.0, 1.0), Occupancy::kFree);
  fill(map, box(501.0, 502.0, 3.0), Occupancy::kOccupied);
  const PictureSize size{100, 100};
  PictureStyle style;
  style.colors = PictureColors::kClass;
  const Picture picture = renderMap(map, makeTopCamera(map, size), style, size, 1);
  std::size_t num_wall = 0;
  for (std::size_t i = 0; i < picture.rgb.size(); i += 3) num_wall += picture.rgb[i] < 128 ? 1 : 0;
  EXPECT_GE(num_wall, 94U) << "of 95 pixels of one row";
  EXPECT_LE(num_wall, 192U);
}

/// A picture of one colour with a pixel of another one in its upper right corner, and with its legend.
Picture makeWithLegend(const std::array<std::uint8_t, 3>& corner, HeightRange heights) {
  Picture picture{240, 180, std::vector<std::uint8_t>(std::size_t{3} * 240 * 180, 100)};
  std::copy(corner.begin(), corner.end(), &picture.rgb[std::size_t{3} * 239]);
  PictureStyle style;
  style.heights = heights;
  drawLegend(picture, style, 0.0);
  return picture;
}

std::size_t countPixels(const Picture& picture, const std::array<std::uint8_t, 3>& color) {
  std::size_t num_pixels = 0;
  for (std::size_t i = 0; i < picture.rgb.size(); i += 3) {
    num_pixels += std::equal(color.begin(), color.end(), &picture.rgb[i]) ? 1 : 0;
  }
  return num_pixels;
}

TEST(MapPicture, namesFreeAndUnknownSpaceInItsLegendWhereTheyAreDrawn) {
  EXPECT_EQ(countPixels(makeWithLegend({1, 2, 3}, {}), kFreeColor), 0U);
  EXPECT_GT(countPixels(makeWithLegend(kFreeColor, {}), kFreeColor), 50U);
  constexpr std::array<std::uint8_t, 3> kInk{20, 20, 20};
  EXPECT_GT(countPixels(makeWithLegend(kUnknownColor, {}), kInk),
            countPixels(makeWithLegend({1, 2, 3}, {}), kInk) + 100);
}

TEST(MapPicture, hasNoLabelTwiceInItsLegend) {
  constexpr std::array<std::uint8_t, 3> kInk{20, 20, 20};
  const auto count_ink = [&](double max_m) {
    return countPixels(makeWithLegend({1, 2, 3}, {0.11, max_m}), kInk);
  };
  EXPECT_GT(count_ink(0.17), 2 * count_ink(0.111)) << "three labels and one";
}

TEST(Progress, isToldWhileAFileIsWrittenWhichStaysAsItWasWhenGivenUp) {
  const MapSnapshot snapshot = makeOther();
  for (const std::string ending : {"csv", "pcd", "ply"}) {
    const TemporaryFolder folder;
    const std::string file = folder / ("map." + ending);
    expectProgress(
        [&](const ProgressListener& listener) { writeMapFile(file, snapshot, listener); });
    replaceFile(file, "old");
    EXPECT_THROW(
        writeMapFile(file, snapshot, [](std::uint64_t, std::uint64_t) { throw GivenUp(); }),
        GivenUp);
    EXPECT_EQ(readFile(file), "old");
    EXPECT_EQ(folder.list().size(), 1U) << "nothing else is left";
  }
}

}  // namespace
}  // namespace cuboid_mapping
