// SPDX-License-Identifier: BSD-3-Clause
#include "../tools/run_program.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

namespace cuboid_mapping::bench::test {
namespace {

using cuboid_mapping::test::ProgramEnd;
using cuboid_mapping::test::runProgram;

/// The figures of each rule, in percent.
struct Figures {
  double voxels = 0.0;
  double precision = 0.0;
  double precision_to_a_voxel = 0.0;
  double recall = 0.0;
  double free_space = 0.0;
};

std::map<std::string, Figures> readTable(const std::string& text) {
  std::map<std::string, Figures> figures;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    const std::size_t end_of_rule = line.find(" |", 2);
    if (end_of_rule == std::string::npos) continue;
    std::string numbers = line.substr(end_of_rule);
    std::replace(numbers.begin(), numbers.end(), '|', ' ');
    Figures row;
    if (std::istringstream(numbers) >> row.voxels >> row.precision >> row.precision_to_a_voxel >>
        row.recall >> row.free_space) {
      figures[line.substr(2, end_of_rule - 2)] = row;
    }
  }
  return figures;
}

TEST(MapTruth, AnEndMarginFindsMoreSurfaceAndKeepsTheFreeSpace) {
  const ProgramEnd end = runProgram({MAP_TRUTH_PROGRAM, "--clouds", "30", "--rings", "12",
                                     "--resolution", "0.2", "--margins", "1"});
  ASSERT_EQ(end.status, 0) << end.out;
  const auto figures = readTable(end.out);
  ASSERT_EQ(figures.size(), 5U) << end.out;
  const Figures& octomap = figures.at("as OctoMap");
  const Figures& margin = figures.at("end margin 1.0 m");
  EXPECT_GT(octomap.voxels, 1000.0);
  EXPECT_GT(octomap.precision, 95.0);
  EXPECT_GE(octomap.precision_to_a_voxel, octomap.precision);
  EXPECT_GT(margin.recall, octomap.recall + 5.0);
  EXPECT_GT(margin.precision, octomap.precision - 2.0);
  EXPECT_GT(margin.free_space, octomap.free_space - 1.0);
  const Figures& keep_surfaces = figures.at("keep_surfaces");
  EXPECT_GT(keep_surfaces.recall, octomap.recall + 1.0);
  EXPECT_GT(keep_surfaces.precision, octomap.precision - 1.0);
  EXPECT_GT(keep_surfaces.free_space, octomap.free_space - 1.0);
  EXPECT_LT(figures.at("beams end 1.0 m early").free_space, octomap.free_space - 5.0);
  EXPECT_LT(figures.at("not beside hits, 1.0 m").free_space, octomap.free_space - 5.0);
}

/// SA, DA and AA of each method, in percent.
std::map<std::string, std::array<double, 3>> readAccuracies(const std::string& text) {
  std::map<std::string, std::array<double, 3>> figures;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    const std::size_t end_of_name = line.find(" |", 2);
    if (end_of_name == std::string::npos) continue;
    std::string numbers = line.substr(end_of_name);
    std::replace(numbers.begin(), numbers.end(), '|', ' ');
    std::array<double, 3> row{};
    if (std::istringstream(numbers) >> row[0] >> row[1] >> row[2]) {
      figures[line.substr(2, end_of_name - 2)] = row;
    }
  }
  return figures;
}

TEST(PassedPoints, OfASimulatedWalkerGoAndThoseOfTheSurroundingsStay) {
  const ProgramEnd end =
      runProgram({PASSED_POINTS_PROGRAM, "--clouds", "40", "--rings", "16", "--resolution", "0.2"});
  ASSERT_EQ(end.status, 0) << end.err;
  const auto figures = readAccuracies(end.out);
  ASSERT_EQ(figures.size(), 6U) << end.out;
  const auto& [sa, da, aa] = figures.at("points never in a void voxel");
  EXPECT_GT(sa, 99.0);
  EXPECT_GT(da, 50.0);
  EXPECT_NEAR(aa, std::sqrt(sa * da), 0.02);
  EXPECT_GT(da, figures.at("points not in moving_points")[1]) << "later clouds tell more";
  EXPECT_GE(figures.at("leave_out and --free-passed")[1], figures.at("the map")[1]);
}

/// A binary PCD file of x, y, z and intensity, with the pose of the sensor.
void writePcd(const std::string& file, const std::string& viewpoint,
              const std::vector<std::array<float, 4>>& points) {
  std::ofstream out(file, std::ios::binary);
  out << "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z intensity\nSIZE 4 4 4 4\nTYPE F F F F\n"
      << "COUNT 1 1 1 1\nWIDTH " << points.size() << "\nHEIGHT 1\nVIEWPOINT " << viewpoint
      << "\nPOINTS " << points.size() << "\nDATA binary\n";
  out.write(reinterpret_cast<const char*>(points.data()),
            static_cast<std::streamsize>(points.size() * sizeof(points[0])));
}

TEST(PassedPoints, ReadsTheLayoutOfTheDynamicMapBenchmark) {
  const cuboid_mapping::test::TemporaryFolder folder;
  std::filesystem::create_directory(folder / "pcd");
  const std::string sensor = "5 0 0.5 0.7071068 0 0 0.7071068";  // Turned to the left.
  std::vector<std::array<float, 4>> wall;
  std::vector<std::array<float, 4>> object;
  for (int y = -50; y <= 50; ++y) {
    for (int z = -50; z <= 50; ++z) {
      const auto side = 0.01F * static_cast<float>(y);
      const auto up = 0.01F * static_cast<float>(z);
      wall.push_back({9.05F, 4.0F * side, 0.5F + 4.0F * up, 0.0F});
      if (std::abs(side) < 0.1F && std::abs(up) < 0.1F) {
        object.push_back({7.05F, 2.0F * side, 0.5F + 2.0F * up, 1.0F});
      }
    }
  }
  writePcd(folder / "pcd/000000.pcd", sensor, wall);
  writePcd(folder / "pcd/000001.pcd", sensor, object);
  std::vector<std::array<float, 4>> truth = wall;
  truth.insert(truth.end(), object.begin(), object.end());
  writePcd(folder / "gt_cloud.pcd", "0 0 0 1 0 0 0", truth);
  const ProgramEnd end = runProgram(
      {PASSED_POINTS_PROGRAM, "--dataset", folder / "", "--resolution", "0.1", "--margin", "0"});
  ASSERT_EQ(end.status, 0) << end.err;
  const auto figures = readAccuracies(end.out);
  ASSERT_EQ(figures.size(), 4U) << end.out;
  EXPECT_EQ(figures.at("points not in moving_points"),
            (std::array<double, 3>{100.0, 100.0, 100.0}));
  EXPECT_EQ(figures.at("the map")[0], 100.0);
  EXPECT_EQ(figures.at("the map")[1], 0.0) << "nothing has cleared the object again";
}

TEST(MapTruth, RefusesADataSetWithoutTruth) {
  const ProgramEnd end = runProgram({MAP_TRUTH_PROGRAM, "--dataset", "somewhere"});
  EXPECT_EQ(end.status, 1);
  EXPECT_NE(end.err.find("--dataset and --truth go together"), std::string::npos) << end.err;
}

}  // namespace
}  // namespace cuboid_mapping::bench::test
