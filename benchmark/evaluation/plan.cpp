// SPDX-License-Identifier: BSD-3-Clause
#include "plan.h"

#include <algorithm>

namespace cuboid_mapping::bench {
namespace {

constexpr int kUsualBranching = 32;

RunSpec octomapRun(double resolution_m, double rotation_deg) {
  RunSpec spec;
  spec.is_octomap = true;
  spec.map.resolution_m = resolution_m;
  spec.rotation_deg = rotation_deg;
  return spec;
}

RunSpec fusionRun(FusionKind fusion, double resolution_m, double rotation_deg = 0.0) {
  RunSpec spec = paperRun(resolution_m, kUsualBranching);
  spec.map.fusion = fusion;
  spec.rotation_deg = rotation_deg;
  return spec;
}

/// What the paper leaves open or names as future work, each in one respect other than paperRun().
std::vector<RunSpec> variants(double resolution_m) {
  const RunSpec paper = paperRun(resolution_m, kUsualBranching);
  std::vector<RunSpec> specs{fusionRun(FusionKind::kClass, resolution_m),
                             fusionRun(FusionKind::kNone, resolution_m)};
  const auto add = [&](auto change) {
    specs.push_back(paper);
    change(specs.back());
  };
  add([](RunSpec& spec) { spec.map.environment = Environment::kStatic; });
  for (const GrowthStep step : {GrowthStep::kOwnWidth, GrowthStep::kNeighbour}) {
    add([step](RunSpec& spec) { spec.growth.step = step; });
  }
  for (const char* search :
       {"largest_gain", "random", "+z -z +x +y -x -y", "-x -y -z +x +y +z", "+x -x +y -y +z -z"}) {
    add([search](RunSpec& spec) { spec.growth.search = *parseSearchStrategy(search); });
  }
  for (const GrowthStarters starters : {GrowthStarters::kEndPoints, GrowthStarters::kChanged}) {
    add([starters](RunSpec& spec) { spec.growth.starters = starters; });
  }
  add([](RunSpec& spec) { spec.map.growth.settle_clouds = 0; });
  for (const int seed : {2, 3}) {  // What is drawn at random: starters, and an order.
    for (const char* search : {"paper", "random"}) {
      add([search, seed](RunSpec& spec) {
        spec.growth.search = *parseSearchStrategy(search);
        spec.map.growth.sampling.seed = seed;
      });
    }
  }
  add([](RunSpec& spec) {  // What comes out best together.
    spec.growth.starters = GrowthStarters::kChanged;
    spec.growth.step = GrowthStep::kNeighbour;
  });
  return specs;
}

RunSpec letterRun(double resolution_m, const PaperReading& reading,
                  int max_branches = kUsualBranching) {
  RunSpec spec = paperRun(resolution_m, max_branches);
  spec.reading = reading;
  return spec;
}

/// The paper to the letter, then each of its open points read the other way, then two together.
std::vector<RunSpec> readings(double resolution_m) {
  std::vector<RunSpec> specs;
  for (const PaperReading& reading :
       {PaperReading{}, PaperReading{false, true, GrowthStep::kOwnWidth},
        PaperReading{true, false, GrowthStep::kOwnWidth},
        PaperReading{true, true, GrowthStep::kCell}, PaperReading{true, false, GrowthStep::kCell},
        PaperReading{false, true, GrowthStep::kCell}}) {
    specs.push_back(letterRun(resolution_m, reading));
  }
  return specs;
}

/// The paper to the letter over M and resolutions, and over the cells drawn for T.
std::vector<RunGroup> letterGroups(const EvaluationOptions& options) {
  std::vector<RunGroup> groups;
  for (const double resolution_m : options.resolutions_m) {
    groups.push_back({resolution_m, 0.0, {octomapRun(resolution_m, 0.0)}});
    for (const int branching : options.branchings) {
      groups.back().specs.push_back(letterRun(resolution_m, PaperReading(), branching));
    }
  }
  groups.push_back({options.reference_m, 0.0, {octomapRun(options.reference_m, 0.0)}});
  for (const double samples_per_m : options.samples_per_m) {
    groups.back().specs.push_back(letterRun(options.reference_m, PaperReading()));
    groups.back().specs.back().map.growth.sampling.per_m = samples_per_m;
  }
  return groups;
}

}  // namespace

RunSpec paperRun(double resolution_m, int max_branches) {
  RunSpec spec;
  spec.map.resolution_m = resolution_m;
  spec.map.fusion = FusionKind::kGrowth;
  spec.map.rtree = {max_branches, std::max(2, max_branches * 3 / 8)};
  return spec;
}

std::vector<RunGroup> makePlan(const EvaluationOptions& options) {
  if (options.runs == RunChoice::kLetter) return letterGroups(options);
  const bool is_speed_only = options.runs == RunChoice::kSpeed;
  std::vector<RunGroup> groups;
  for (const double resolution_m : options.resolutions_m) {
    RunGroup group{resolution_m, 0.0, {octomapRun(resolution_m, 0.0)}};
    for (const int branching : options.branchings) {
      group.specs.push_back(paperRun(resolution_m, branching));
    }
    if (!is_speed_only) {
      group.specs.push_back(fusionRun(FusionKind::kClass, resolution_m));
    } else if (resolution_m == options.reference_m) {
      group.specs.push_back(letterRun(resolution_m, PaperReading()));
    }
    groups.push_back(std::move(group));
  }
  if (is_speed_only) return groups;
  const double reference_m = options.reference_m;
  RunGroup reference{reference_m, 0.0, {octomapRun(reference_m, 0.0)}};
  reference.specs.push_back(paperRun(reference_m, kUsualBranching));
  for (const RunSpec& spec : variants(reference_m)) reference.specs.push_back(spec);
  for (const RunSpec& spec : readings(reference_m)) reference.specs.push_back(spec);
  groups.push_back(std::move(reference));
  for (const double rotation_deg : {10.0, 30.0, 45.0}) {
    groups.push_back({reference_m,
                      rotation_deg,
                      {octomapRun(reference_m, rotation_deg),
                       fusionRun(FusionKind::kGrowth, reference_m, rotation_deg),
                       fusionRun(FusionKind::kClass, reference_m, rotation_deg)}});
  }
  return groups;
}

}  // namespace cuboid_mapping::bench
