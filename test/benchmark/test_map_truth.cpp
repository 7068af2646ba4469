// SPDX-License-Identifier: BSD-3-Clause
#include "../tools/run_program.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <sstream>

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
  ASSERT_EQ(figures.size(), 4U) << end.out;
  const Figures& octomap = figures.at("as OctoMap");
  const Figures& margin = figures.at("end margin 1.0 m");
  EXPECT_GT(octomap.voxels, 1000.0);
  EXPECT_GT(octomap.precision, 95.0);
  EXPECT_GE(octomap.precision_to_a_voxel, octomap.precision);
  EXPECT_GT(margin.recall, octomap.recall + 5.0);
  EXPECT_GT(margin.precision, octomap.precision - 2.0);
  EXPECT_GT(margin.free_space, octomap.free_space - 1.0);
  EXPECT_LT(figures.at("beams end 1.0 m early").free_space, octomap.free_space - 5.0);
  EXPECT_LT(figures.at("not beside hits, 1.0 m").free_space, octomap.free_space - 5.0);
}

TEST(MapTruth, RefusesADataSetWithoutTruth) {
  const ProgramEnd end = runProgram({MAP_TRUTH_PROGRAM, "--dataset", "somewhere"});
  EXPECT_EQ(end.status, 1);
  EXPECT_NE(end.err.find("--dataset and --truth go together"), std::string::npos) << end.err;
}

}  // namespace
}  // namespace cuboid_mapping::bench::test
