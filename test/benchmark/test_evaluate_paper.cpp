// SPDX-License-Identifier: BSD-3-Clause
#include "../tools/run_program.h"
#include "room_scans.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>
#include <string>

namespace cuboid_mapping::bench::test {
namespace {

using cuboid_mapping::test::ProgramEnd;
using cuboid_mapping::test::readText;
using cuboid_mapping::test::runProgram;
using cuboid_mapping::test::TemporaryFolder;
using Json = nlohmann::json;

/// Moving objects split cuboids, which fuse again; cuboids of static growth stay.
void expectSplits(const Json& passing_objects) {
  for (const Json& run : passing_objects) {
    ASSERT_EQ(run["over_time"].size(), 30U) << run;
    const Json& last = run["over_time"].back();
    EXPECT_EQ(last["clouds"], 300);
    EXPECT_GT(last["cells"], 0);
    if (run["map"] == "octomap") continue;
    const bool is_frozen = run["fusion"] == "growth" && run["environment"] == "static";
    EXPECT_EQ(last["splits"] == 0, is_frozen) << run;
    EXPECT_EQ(last["fused_again"] == 0, is_frozen) << run;
  }
}

class EvaluatePaper : public testing::Test {
 protected:
  EvaluatePaper() { writeScanFolder(dataset_); }

  ProgramEnd run(const std::string& dataset) const {
    return runProgram({EVALUATE_PAPER_PROGRAM, dataset, "--out", out_, "--resolutions", "0.2,0.5",
                       "--branching", "4,32", "--drives", "1", "--query-time", "0.01"});
  }

  TemporaryFolder folder_;
  std::string dataset_ = folder_ / "room";
  std::string out_ = folder_ / "evaluation";
};

TEST_F(EvaluatePaper, writesFiguresAndPlotsAndGoesOnWhereItWas) {
  const ProgramEnd end = run(dataset_);
  ASSERT_EQ(end.status, 0) << end.err;
  const Json report = Json::parse(readText(out_ + "/evaluation.json"));
  std::size_t num_agreeing = 0;
  for (const Json& run : report["runs"]) {
    EXPECT_GT(run["cells"], 0);
    EXPECT_GT(run["insert_us_per_point"], 0.0);
    EXPECT_EQ(run["cells_over_time"].size(), static_cast<std::size_t>(kNumScans));
    if (!run.contains("known_mismatch")) continue;
    EXPECT_EQ(run["known_mismatch"], 0.0) << run;
    EXPECT_EQ(run["class_mismatch"], 0.0) << run;
    EXPECT_LE(run["max_log_odds_difference"], 1e-3) << run;
    ++num_agreeing;
  }
  EXPECT_GE(num_agreeing, 20U);
  EXPECT_EQ(std::count_if(report["runs"].begin(), report["runs"].end(),
                          [](const Json& run) { return run["map"] == "paper"; }),
            6);
  const std::string csv = readText(out_ + "/evaluation.csv");
  EXPECT_EQ(static_cast<std::size_t>(std::count(csv.begin(), csv.end(), '\n')),
            report["runs"].size() + 1);
  for (const char* plot : {"nodes", "cells", "insertion", "access", "sizes", "time", "rotation"}) {
    for (const char* format : {".svg", ".png"}) {
      const std::string file = out_ + "/room/" + plot + format;
      ASSERT_TRUE(std::filesystem::exists(file)) << file;
      EXPECT_GT(std::filesystem::file_size(file), 1000U) << file;
    }
  }

  expectSplits(report["passing_objects"]);

  // Existing results are kept; missing ones are computed.
  const std::string kept = out_ + "/room/runs/class_0.5m_M32.json";
  const std::string removed = out_ + "/room/runs/class_0.2m_M32.json";
  const auto time_before = std::filesystem::last_write_time(kept);
  ASSERT_TRUE(std::filesystem::remove(removed));
  ASSERT_EQ(run(dataset_).status, 0);
  EXPECT_EQ(std::filesystem::last_write_time(kept), time_before);
  EXPECT_TRUE(std::filesystem::exists(removed));
}

TEST_F(EvaluatePaper, SaysWhatIsWrongWithADataset) {
  const ProgramEnd end = run(folder_ / "nowhere");
  EXPECT_EQ(end.status, 1);
  EXPECT_NE(end.err.find("nowhere"), std::string::npos) << end.err;
}

TEST_F(EvaluatePaper, AblationsTimeEachPartAndAgree) {
  const ProgramEnd end =
      runProgram({ABLATIONS_PROGRAM, dataset_, "--resolution", "0.2", "--runs", "1"});
  ASSERT_EQ(end.status, 0) << end.err;
  const Json report = Json::parse(end.out);
  for (const char* way : {"octomap", "octomap_with_ray_walk", "ray_walk", "voxels_without_tree",
                          "fused_at_the_end", "fused_after_every_cloud"}) {
    EXPECT_GT(report["insertion"][way]["median_s"], 0.0) << way;
  }
  for (const char* map : {"cuboid_mapping", "tree_only"}) {
    EXPECT_GT(report["queries"][map]["rays_per_s"], 0.0) << map;
    EXPECT_EQ(report["queries"][map]["different_answers"], 0) << map;
  }
  EXPECT_GT(report["visit_occupied"]["octomap_skipping_ms"], 0.0);
}

TEST_F(EvaluatePaper, SpeedOnlyRunsWhatRatiosRestOnAndMarksCurvesOfOnePoint) {
  const ProgramEnd end =
      runProgram({EVALUATE_PAPER_PROGRAM, dataset_, "--out", out_, "--resolutions", "0.2",
                  "--branching", "32", "--runs", "speed", "--query-time", "0.01"});
  ASSERT_EQ(end.status, 0) << end.err;
  std::set<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(out_ + "/room/runs")) {
    names.insert(entry.path().stem().string());
  }
  EXPECT_EQ(names, (std::set<std::string>{"octomap_0.2m", "growth_0.2m_M32_cell_paper_sampled",
                                          "paper_0.2m_M32_own_width_full_along"}));
  EXPECT_NE(readText(out_ + "/room/access.svg").find("OctoMap, pruned, one point"),
            std::string::npos);
}

TEST_F(EvaluatePaper, LetterRunsSweepBranchesResolutionsAndStarters) {
  const ProgramEnd end = runProgram({EVALUATE_PAPER_PROGRAM, dataset_, "--out", out_,
                                     "--resolutions", "0.2,0.4", "--branching", "4,32", "--samples",
                                     "0,0.1,5", "--runs", "letter", "--query-time", "0.01"});
  ASSERT_EQ(end.status, 0) << end.err;
  std::map<std::string, std::size_t> cells;
  for (const auto& entry : std::filesystem::directory_iterator(out_ + "/room/runs")) {
    cells[entry.path().stem().string()] = Json::parse(readText(entry.path().string()))["cells"];
  }
  ASSERT_EQ(cells.size(), 8U) << end.out;
  const std::string usual = "paper_0.2m_M32_own_width_full_along";
  EXPECT_EQ(cells.at("paper_0.2m_M4_own_width_full_along"), cells.at(usual));
  EXPECT_LE(cells.at(usual + "_T5"), cells.at(usual + "_T0"));
}

TEST_F(EvaluatePaper, IndexesOfCuboidsAnswerAlike) {
  const ProgramEnd end = runProgram({CUBOID_INDEXES_PROGRAM, dataset_, "--resolution", "0.2",
                                     "--runs", "1", "--query-time", "0.01"});
  ASSERT_EQ(end.status, 0) << end.err;
  const Json report = Json::parse(end.out);
  ASSERT_EQ(report["queries"].size(), 12U);
  for (const Json& kind : report["queries"]) {
    EXPECT_GT(kind["compared"], 0) << kind;
    for (const char* time : {"rtree_us", "brick_hash_us", "list_us"}) EXPECT_GT(kind[time], 0.0);
  }
}

TEST_F(EvaluatePaper, CorridorsOfAllMapsAreRight) {
  const ProgramEnd end =
      runProgram({CORRIDORS_PROGRAM, dataset_, "--resolution", "0.2", "--pairs", "10"});
  ASSERT_EQ(end.status, 0) << end.err;
  const Json report = Json::parse(end.out);
  ASSERT_EQ(report["rows"].size(), 30U);
  int num_again = 0;
  for (const Json& row : report["rows"]) {
    if (!row["found"]) continue;
    EXPECT_GE(row["length_m"], row["distance_m"].get<double>() - 1e-9) << row;
    EXPECT_GE(row["volume_m3"], 0.008 - 1e-9) << row;
    num_again += row.contains("again") ? 1 : 0;
  }
  EXPECT_GT(num_again, 0);
}

TEST_F(EvaluatePaper, RateAndDistortionOfEachMap) {
  const ProgramEnd end =
      runProgram({RATE_DISTORTION_PROGRAM, dataset_, "--resolution", "0.2", "--coarsest", "2"});
  ASSERT_EQ(end.status, 0) << end.err;
  std::map<std::pair<std::string, double>, Json> rows;
  const Json report = Json::parse(end.out);
  for (const Json& row : report["rows"]) {
    rows[{row["map"], row["resolution_m"]}] = row;
  }
  for (const std::string map : {"cuboid_mapping", "octomap"}) {
    const Json& exact = rows.at({map, 0.2});
    const Json& classes = rows.at({map + ", classes", 0.2});
    EXPECT_EQ(exact["lost_bits"], 0.0) << map;
    EXPECT_GT(classes["lost_bits"], 0.0) << map;
    EXPECT_LT(classes["file_bytes"], exact["file_bytes"]) << map;
    EXPECT_GT(rows.at({map, 0.4})["lost_bits"], 0.0) << map;
    EXPECT_LT(rows.at({map, 0.4})["cells"], exact["cells"]) << map;
  }
}

}  // namespace
}  // namespace cuboid_mapping::bench::test
