// SPDX-License-Identifier: BSD-3-Clause
#include "plots.h"

#include <algorithm>
#include <cstdio>
#include <functional>
#include <map>
#include <set>
#include <sstream>
#include <stdexcept>

namespace cuboid_mapping::bench {
namespace {

using nlohmann::json;
using Runs = std::vector<json>;
/// Whether a run belongs to a curve.
using Filter = std::function<bool(const json&)>;
/// A figure of a run.
using Figure = std::function<double(const json&)>;

struct Point {
  double x;
  double y;
};

/// Curves that gnuplot draws.
class Plot {
 public:
  Plot(const std::string& x_label, const std::string& y_label) {
    settings_ << "set xlabel \"" << x_label << "\"\nset ylabel \"" << y_label << "\"\n"
              << "set grid\nset key outside\nset autoscale xfix\n";
  }

  Plot& set(const std::string& setting) {
    settings_ << "set " << setting << '\n';
    return *this;
  }

  /// Adds a curve, unless it has no point.
  void add(const std::string& title, std::vector<Point> points) {
    if (points.empty()) return;
    curves_.push_back({title, std::move(points)});
  }

  /// Draws file.svg and file.png.
  void draw(const std::string& file) const {
    if (curves_.empty()) return;
    FILE* gnuplot = popen("gnuplot", "w");
    if (gnuplot == nullptr) throw std::runtime_error("cannot run gnuplot");
    for (const char* terminal : {"svg", "png"}) {
      const std::string script = makeScript(file, terminal);
      std::fwrite(script.data(), 1, script.size(), gnuplot);
    }
    if (pclose(gnuplot) != 0) {
      throw std::runtime_error("gnuplot failed to draw " + file +
                               ": install gnuplot-nox, and run this again, which repeats no run");
    }
  }

 private:
  struct Curve {
    std::string title;
    std::vector<Point> points;
  };

  [[nodiscard]] std::string makeScript(const std::string& file, const std::string& terminal) const {
    std::ostringstream script;
    script << "set terminal " << terminal << " size 900,400 background rgb 'white' noenhanced\n"
           << "set output \"" << file << '.' << terminal << "\"\n"
           << settings_.str() << "plot ";
    for (const Curve& curve : curves_) {
      // A curve of one point is marked as such: there is no line that would lead to it.
      const bool is_point = curve.points.size() == 1;
      script << (&curve == &curves_.front() ? "" : ", ") << "\"-\" using 1:2 with "
             << (is_point ? "points pointtype 2 pointsize 1.5"
                          : "linespoints pointtype 7 pointsize 0.6")
             << " title \"" << curve.title << (is_point ? ", one point" : "") << '"';
    }
    script << '\n';
    for (const Curve& curve : curves_) {
      for (const Point& point : curve.points) script << point.x << ' ' << point.y << '\n';
      script << "e\n";
    }
    script << "unset output\n";
    return script.str();
  }

  std::ostringstream settings_;
  std::vector<Curve> curves_;
};

Figure figure(const std::string& key) {
  return [key](const json& run) { return run.at(key).get<double>(); };
}

bool isOctomap(const json& run) { return run["map"] == "octomap"; }
/// OctoMap's runs and those of the paper to the letter have no fusion.
bool isFusion(const json& run, const std::string& fusion) {
  return run.value("fusion", "") == fusion;
}
bool isUnrotated(const json& run) { return run["rotation_deg"] == 0.0; }
/// The paper's method as it is swept over resolution and M.
bool isPaper(const json& run) {
  return isFusion(run, "growth") && run["environment"] == "dynamic" && run["step"] == "cell" &&
         run["search"] == "paper" && run["starters"] == "sampled" && run["settle_clouds"] == 10 &&
         run.value("seed", 1) == 1;
}
bool hasUsualM(const json& run) { return run["M"] == 32; }

std::vector<Point> select(const Runs& runs, const Filter& filter, const Figure& x,
                          const Figure& y) {
  std::vector<Point> points;
  for (const json& run : runs) {
    if (filter(run)) points.push_back({x(run), y(run)});
  }
  std::sort(points.begin(), points.end(), [](const Point& a, const Point& b) { return a.x < b.x; });
  return points;
}

/// A figure over the resolution: OctoMap, and a curve for every M.
Plot overResolution(const Runs& runs, const std::string& label, const std::string& key) {
  Plot plot("voxel [m]", label);
  plot.set("logscale y");
  const Figure x = figure("resolution_m");
  const Filter is_octomap = [](const json& run) { return isOctomap(run) && isUnrotated(run); };
  plot.add("OctoMap, pruned", select(runs, is_octomap, x, figure(key)));
  std::set<int> branchings;
  for (const json& run : runs) {
    if (!isOctomap(run) && isPaper(run)) branchings.insert(run["M"].get<int>());
  }
  for (const int m : branchings) {
    plot.add("growth, M = " + std::to_string(m), select(
                                                     runs,
                                                     [m](const json& run) {
                                                       return isUnrotated(run) && !isOctomap(run) &&
                                                              isPaper(run) && run["M"] == m;
                                                     },
                                                     x, figure(key)));
  }
  return plot;
}

void drawFigureSeven(const Runs& runs, const std::string& folder) {
  const Figure x = figure("resolution_m");
  const Filter is_octomap = [](const json& run) { return isOctomap(run) && isUnrotated(run); };
  Plot nodes = overResolution(runs, "nodes of the hierarchy, without cells", "hierarchy_nodes");
  nodes.add("OctoMap, wc", select(runs, is_octomap, x, figure("hierarchy_nodes_uncompressed")));
  nodes.draw(folder + "/nodes");

  Plot cells("voxel [m]", "cells");
  cells.set("logscale y");
  cells.add("full 3D grid", select(runs, is_octomap, x, figure("full_grid_cells")));
  cells.add("OctoMap, wc", select(runs, is_octomap, x, figure("cells_uncompressed")));
  cells.add("OctoMap, pruned", select(runs, is_octomap, x, figure("cells")));
  for (const char* fusion : {"growth", "class"}) {
    const Filter is_fusion = [fusion](const json& run) {
      return isFusion(run, fusion) && isUnrotated(run) && hasUsualM(run) &&
             (isPaper(run) || std::string(fusion) == "class");
    };
    cells.add(fusion, select(runs, is_fusion, x, figure("cells")));
  }
  cells.draw(folder + "/cells");

  overResolution(runs, "insertion, CPU us per point", "insert_us_per_point")
      .draw(folder + "/insertion");
  overResolution(runs, "visit of all occupied cells, CPU ms", "access_occupied_ms")
      .draw(folder + "/access");
}

/// The runs at the reference resolution that are compared with each other.
std::vector<std::pair<std::string, json>> referenceRuns(const Runs& runs, double reference_m) {
  std::vector<std::pair<std::string, json>> found;
  for (const json& run : runs) {
    if (run["resolution_m"] != reference_m || !isUnrotated(run)) continue;
    if (isOctomap(run)) {
      found.emplace_back("OctoMap, pruned", run);
    } else if (hasUsualM(run) && (isPaper(run) || isFusion(run, "class"))) {
      found.emplace_back(run["fusion"].get<std::string>(), run);
    } else if (hasUsualM(run) && isFusion(run, "growth") && run["environment"] == "static") {
      found.emplace_back("growth, static", run);
    }
  }
  return found;
}

std::vector<Point> toPoints(const json& values, double x_step) {
  std::vector<Point> points;
  for (std::size_t i = 0; i < values.size(); ++i) {
    points.push_back({x_step * static_cast<double>(i + 1), values[i].get<double>()});
  }
  return points;
}

void drawReference(const Runs& runs, double reference_m, const std::string& folder) {
  Plot sizes("size of a cell: 2^n voxels and more", "cells");
  sizes.set("logscale y");
  Plot time("clouds", "cells");
  time.set("yrange [0:*]");
  for (const auto& [title, run] : referenceRuns(runs, reference_m)) {
    std::vector<Point> points = toPoints(run["size_histogram"], 1.0);
    for (Point& point : points) point.x -= 1.0;
    points.erase(std::remove_if(points.begin(), points.end(),
                                [](const Point& point) { return point.y == 0.0; }),
                 points.end());
    sizes.add(title, points);
    time.add(title, toPoints(run["cells_over_time"], 1.0));
  }
  sizes.draw(folder + "/sizes");
  time.draw(folder + "/time");
}

void drawRotation(const Runs& runs, double reference_m, const std::string& folder) {
  std::map<double, double> octomap_cells;
  const auto is_reference = [&](const json& run) { return run["resolution_m"] == reference_m; };
  for (const json& run : runs) {
    if (!isOctomap(run) || !is_reference(run)) continue;
    octomap_cells[run["rotation_deg"].get<double>()] = run["cells"].get<double>();
  }
  if (octomap_cells.size() < 2) return;
  Plot plot("rotation about z [degrees]", "cells, as share of OctoMap's");
  plot.set("yrange [0:*]");
  for (const char* fusion : {"growth", "class"}) {
    plot.add(fusion, select(
                         runs,
                         [&](const json& run) {
                           return isFusion(run, fusion) && is_reference(run) && hasUsualM(run) &&
                                  (isPaper(run) || std::string(fusion) == "class");
                         },
                         figure("rotation_deg"),
                         [&](const json& run) {
                           return run["cells"].get<double>() /
                                  octomap_cells.at(run["rotation_deg"].get<double>());
                         }));
  }
  plot.draw(folder + "/rotation");
}

}  // namespace

void drawPlots(const std::vector<json>& runs, double reference_m, const std::string& folder) {
  drawFigureSeven(runs, folder);
  drawReference(runs, reference_m, folder);
  drawRotation(runs, reference_m, folder);
}

}  // namespace cuboid_mapping::bench
