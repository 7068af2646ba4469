// SPDX-License-Identifier: BSD-3-Clause
// The evaluation of the paper (Section V, Figure 7), and beyond it: runs, CSV, JSON, plots.
#include "passing_objects.h"
#include "plan.h"
#include "plots.h"

#include "command_line.h"
#include "dataset.h"
#include "machine.h"
#include "progress_bar.h"
#include "result_file.h"

#include "cuboid_mapping/interop/octomap_parity.h"
#include "cuboid_mapping/io/text.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iostream>
#include <map>
#include <optional>
#include <stdexcept>

namespace cuboid_mapping::bench {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// Figures of finished runs, a file each: an evaluation that was cut off goes on where it was.
class RunFiles {
 public:
  explicit RunFiles(const fs::path& folder) : folder_(folder) { fs::create_directories(folder); }

  [[nodiscard]] bool has(const std::string& name) const { return fs::exists(pathOf(name)); }

  [[nodiscard]] json read(const std::string& name) const {
    std::ifstream in(pathOf(name).string());
    return json::parse(in);
  }

  /// Names of all runs, sorted.
  [[nodiscard]] std::vector<std::string> list() const {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder_)) {
      if (entry.path().extension() == ".json") names.push_back(entry.path().stem().string());
    }
    std::sort(names.begin(), names.end());
    return names;
  }

  void write(const std::string& name, const json& run) const {
    ResultFile(pathOf(name).string()).write(run.dump(1) + '\n');
  }

 private:
  [[nodiscard]] fs::path pathOf(const std::string& name) const {
    return folder_ / (name + ".json");
  }
  fs::path folder_;
};

std::optional<int> parseOptions(int argc, char** argv, EvaluationOptions& options) {
  CommandLine line("evaluate_paper",
                   "Repeats the evaluation of the paper, and compares with OctoMap.");
  line.addArgument("datasets", options.datasets,
                   "folders with poses.txt and scans/NNNN.pcd, or .graph files of OctoMap");
  line.addText("out", options.folder,
               "folder for figures and plots; existing runs in it are used again");
  line.addList("resolutions", options.resolutions_m, "edges of a voxel [m]", {0.001, 1000.0});
  line.addList("branching", options.branchings, "M of the R-tree",
               {4, RTreeConfig::kMaxBranchesLimit});
  line.addNumber("reference", options.reference_m,
                 "resolution at which strategies and rotations are compared [m]", {0.001, 1000.0});
  std::string runs = "all";
  line.addText("runs", runs,
               "speed: only the runs for ratios of speed (OctoMap, growth and, at the reference, "
               "the paper to the letter); letter: OctoMap and the paper to the letter, with each M "
               "at each resolution, and each density of T at the reference",
               {"all", "speed", "letter"});
  line.addList("samples", options.samples_per_m,
               "with --runs letter: random cells of T along the beams [1/m]", {0.0, 1000.0});
  line.addNumber("drives", options.num_drives, "simulated drives with moving objects", {1, 1000});
  line.addNumber("clouds", options.max_clouds, "only the first N clouds", {1});
  line.addNumber("every", options.every, "only the first of N clouds", {1, 1000000});
  line.addNumber("query-time", options.query_time_s,
                 "least CPU time for the visits of a run that are timed [s]", {0.001, 60.0});
  const auto status = line.parse(argc, argv);
  options.runs = runs == "speed"    ? RunChoice::kSpeed
                 : runs == "letter" ? RunChoice::kLetter
                                    : RunChoice::kAll;
  return status;
}

std::string titleOf(const std::string& dataset) {
  const fs::path path = fs::absolute(dataset);
  const bool ends_in_slash = path.filename() == "." || path.filename().empty();
  return (ends_in_slash ? path.parent_path() : path).stem().string();
}

/// Does the runs of a group that are not there yet.
void runGroup(const RunGroup& group, const std::vector<Scan>& scans, const RunFiles& files,
              double min_query_s, const std::function<void()>& on_done) {
  std::optional<octomap::OcTree> octomap;
  std::vector<Scan> rotated;
  for (const RunSpec& spec : group.specs) {
    const std::string name = nameOf(spec);
    if (!files.has(name)) {
      if (!octomap) {
        rotated = rotate(scans, group.rotation_deg);
        octomap.emplace(makeOctomap(spec.map));
        const json run = runOctomap(group.specs.front(), rotated, min_query_s, *octomap);
        const std::string octomap_name = nameOf(group.specs.front());
        if (!files.has(octomap_name)) files.write(octomap_name, run);
      }
      if (spec.reading) {
        files.write(name, runPaperGrid(spec, rotated, min_query_s));
      } else if (!spec.is_octomap) {
        files.write(name, runCuboidMap(spec, rotated, min_query_s, *octomap));
      }
    }
    on_done();
  }
}

void writeCsv(const std::vector<json>& runs, const fs::path& path) {
  const char* columns[] = {"dataset",
                           "commit",
                           "map",
                           "resolution_m",
                           "rotation_deg",
                           "M",
                           "fusion",
                           "environment",
                           "step",
                           "search",
                           "starters",
                           "seed",
                           "settle_clouds",
                           "gap_free",
                           "along",
                           "samples_per_m",
                           "clouds",
                           "points",
                           "voxels",
                           "cells",
                           "occupied_cells",
                           "free_cells",
                           "hierarchy_nodes",
                           "height",
                           "nodes_of_point_query",
                           "cells_uncompressed",
                           "hierarchy_nodes_uncompressed",
                           "full_grid_cells",
                           "insert_cpu_s",
                           "insert_us_per_point",
                           "access_occupied_ms",
                           "bytes",
                           "known_mismatch",
                           "class_mismatch",
                           "max_log_odds_difference"};
  std::ofstream out(path.string());
  for (const char* column : columns) out << (column == columns[0] ? "" : ",") << column;
  out << '\n';
  for (const json& run : runs) {
    for (const char* column : columns) {
      out << (column == columns[0] ? "" : ",");
      if (run.contains(column)) out << run[column];
    }
    out << '\n';
  }
  if (!out) throw std::runtime_error("cannot write " + path.string());
}

/// Does all runs of a data set.
void evaluate(const std::string& dataset, const EvaluationOptions& options) {
  const RunFiles files(fs::path(options.folder) / titleOf(dataset) / "runs");
  const std::vector<RunGroup> plan = makePlan(options);
  std::size_t num_runs = 0;
  for (const RunGroup& group : plan) num_runs += group.specs.size();
  const std::vector<Scan> scans =
      readScans({dataset, "", "", options.max_clouds, 1, 1, options.every});
  ProgressBar progress("runs of " + titleOf(dataset), num_runs);
  std::size_t num_done = 0;
  for (const RunGroup& group : plan) {
    runGroup(group, scans, files, options.query_time_s, [&] { progress.update(++num_done); });
  }
}

/// All runs in a folder, those of earlier calls too, by data set.
std::map<std::string, std::vector<json>> readRuns(const fs::path& folder) {
  std::map<std::string, std::vector<json>> runs;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (!fs::exists(entry.path() / "runs")) continue;
    const RunFiles files(entry.path() / "runs");
    const std::string dataset = entry.path().filename().string();
    for (const std::string& name : files.list()) {
      runs[dataset].push_back(files.read(name));
      runs[dataset].back()["dataset"] = dataset;
    }
  }
  return runs;
}

int run(int argc, char** argv) {
  EvaluationOptions options;
  if (const auto status = parseOptions(argc, argv, options)) return *status;
  for (const std::string& dataset : options.datasets) evaluate(dataset, options);
  const fs::path folder(options.folder);
  std::vector<json> runs;
  for (const auto& [dataset, of_dataset] : readRuns(folder)) {
    drawPlots(of_dataset, options.reference_m, (folder / dataset).string());
    runs.insert(runs.end(), of_dataset.begin(), of_dataset.end());
  }
  const RunFiles files(folder);
  const bool has_drives = options.runs == RunChoice::kAll;
  if (has_drives && !files.has("passing_objects")) {
    files.write("passing_objects", evaluatePassingObjects(options.reference_m, options.num_drives));
  }
  const Machine machine = describeMachine();
  json report{{"cpu", machine.cpu},
              {"compiler", machine.compiler},
              {"build_type", machine.build_type},
              {"runs", runs}};
  if (has_drives) report["passing_objects"] = files.read("passing_objects");
  files.write("evaluation", report);
  writeCsv(runs, folder / "evaluation.csv");
  std::cout << counted(runs.size(), "run") << "; figures and plots are in " << folder.string()
            << std::endl;
  return 0;
}

}  // namespace
}  // namespace cuboid_mapping::bench

int main(int argc, char** argv) {
  return cuboid_mapping::runMain("evaluate_paper", argc, argv, cuboid_mapping::bench::run);
}
