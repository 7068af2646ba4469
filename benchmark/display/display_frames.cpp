// SPDX-License-Identifier: BSD-3-Clause
#include "scenes.h"
#include "soak.h"
#include "ways.h"

#include "command_line.h"
#include "cuboid_mapping/map/cuboid_search.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <map>
#include <string>
#include <vector>

namespace cuboid_mapping_rviz::bench {
namespace {

using namespace cuboid_mapping;

using Clock = std::chrono::steady_clock;

constexpr double kPatience_s = 300.0;
/// The ways take turns, so that what else the machine does meets all of them.
constexpr int kTurns = 3;
constexpr int kFrames = 8;
constexpr double kMostOfTurn_s = 10.0;
constexpr double kRest_s = 1.0;  // A view that has just moved may be drawn with less detail.

/// Time on the clock, and of all threads of the process: the renderer's, too.
struct Duration {
  double wall_s = 0.0;
  double cpu_s = 0.0;
};

class Stopwatch {
 public:
  [[nodiscard]] Duration elapsed() const {
    return {std::chrono::duration<double>(Clock::now() - start_).count(),
            static_cast<double>(std::clock() - cpu_start_) / CLOCKS_PER_SEC};
  }

 private:
  Clock::time_point start_ = Clock::now();
  std::clock_t cpu_start_ = std::clock();
};

double medianOf(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2),
                   values.end());
  return values[values.size() / 2];
}

std::vector<double> partOf(const std::vector<Duration>& durations, double Duration::*part) {
  std::vector<double> values;
  values.reserve(durations.size());
  for (const Duration& duration : durations) values.push_back(duration.*part);
  return values;
}

/// What is seen: all of the map, or the surroundings of the robot, as rviz shows them when it starts.
struct View {
  const char* name;
  double distance_m;
};

/// Frames of one way and view.
class Frames {
 public:
  std::vector<Duration> still;
  std::vector<Duration> turned;
  Ogre::RenderTarget::FrameStats statistics;  ///< Of a still frame.
  std::size_t turned_triangles = 0;

  void draw(test::RvizWindow& window, Way& way, const View& view) {
    window.look(view.distance_m, 0.7, 0.7);
    const Stopwatch rest;
    while (rest.elapsed().wall_s < kRest_s) (void)drawOne(window, way);
    for (int i = 0; i < kFrames && rest.elapsed().wall_s < kMostOfTurn_s; ++i) {
      still.push_back(drawOne(window, way));
    }
    statistics = window.statistics();
    const Stopwatch turn;
    for (int i = 0; i < kFrames && turn.elapsed().wall_s < kMostOfTurn_s; ++i) {
      window.look(view.distance_m, 0.7 + 0.2 * (i + 1), 0.7);
      turned.push_back(drawOne(window, way));
    }
    turned_triangles = window.statistics().triangleCount;
  }

 private:
  Duration drawOne(test::RvizWindow& window, Way& way) {
    const Stopwatch frame;
    way.update(last_frame_s_);
    window.drawFrame();
    const Duration duration = frame.elapsed();
    last_frame_s_ = duration.wall_s;
    return duration;
  }

  double last_frame_s_ = 0.0;
};

/// A way that has been loaded.
struct Runner {
  std::unique_ptr<Way> way;
  std::map<std::string, Frames> frames;  ///< By name of the view.
};

class Comparison {
 public:
  Comparison(test::RvizWindow& window, CuboidMap map) : window_(window), map_(std::move(map)) {
    CellBox bounds = kNoCells();
    visitAll(map_, CuboidFilter::kOccupied, [&](const Cuboid& cuboid) {
      for (int axis = 0; axis < 3; ++axis) {
        bounds.min[axis] = std::min(bounds.min[axis], cuboid.box.min[axis]);
        bounds.max[axis] = std::max(bounds.max[axis], cuboid.box.max[axis]);
      }
      return Visit::kContinue;
    });
    const Cell size = bounds.size();
    views_ = {{"10 m away", 10.0},
              {"all of it", 1.1 * std::max(size.x, size.y) * map_.grid().resolution()}};
    num_boxes_ = static_cast<double>(countCuboids(map_).occupied);
  }

  void run(bool is_display_only) {
    for (auto& way : makeAllWays()) {
      if (is_display_only && dynamic_cast<DisplayWay*>(way.get()) == nullptr) continue;
      load(std::move(way));
    }
    for (int turn = 0; turn < kTurns; ++turn) {
      for (Runner& runner : runners_) {
        runner.way->setVisible(true);
        for (const View& view : views_) {
          runner.frames[view.name].draw(window_, *runner.way, view);
        }
        runner.way->setVisible(false);
      }
    }
    for (const Runner& runner : runners_) printFrames(runner);
    std::fflush(stdout);
    runners_.clear();
    window_.manager().removeAllDisplays();
    window_.update();
  }

 private:
  static CellBox kNoCells() {
    constexpr std::int32_t kFar = Grid::kMaxCell;
    return {{kFar, kFar, kFar}, {-kFar, -kFar, -kFar}};
  }

  void load(std::unique_ptr<Way> way) {
    window_.look(views_.back().distance_m, 0.7, 0.7);
    window_.drawFrame();  // Without the way before, for isDrawn().
    const Stopwatch stopwatch;
    way->load(window_, map_);
    const bool is_drawn = window_.updateUntil([&] { return way->isDrawn(window_); }, kPatience_s);
    const Duration loading = stopwatch.elapsed();
    if (is_drawn) {
      printCosts(*way, loading);  // Now: with every way that is loaded, rviz has more to do.
      runners_.push_back({std::move(way), {}});
      runners_.back().way->setVisible(false);
    } else {
      way->setVisible(false);
      std::printf("%s: not drawn within %.0f s\n", way->name(), kPatience_s);
    }
  }

  void printFrames(const Runner& runner) const {
    for (const View& view : views_) {
      const Frames& frames = runner.frames.at(view.name);
      const std::vector<double> turned_cpu_s = partOf(frames.turned, &Duration::cpu_s);
      const double still_cpu_s = medianOf(partOf(frames.still, &Duration::cpu_s));
      const double longest_s = *std::max_element(turned_cpu_s.begin(), turned_cpu_s.end());
      std::printf(
          "| frame | %.0f | %s | %s | %.1f | %.0f | %.1f | %.0f | %.0f | %zu | %zu | %zu |\n",
          num_boxes_, view.name, runner.way->name(),
          1.0 / medianOf(partOf(frames.turned, &Duration::wall_s)), 1e3 * medianOf(turned_cpu_s),
          1.0 / medianOf(partOf(frames.still, &Duration::wall_s)), 1e3 * still_cpu_s,
          1e3 * (longest_s - still_cpu_s), frames.turned_triangles, frames.statistics.triangleCount,
          frames.statistics.batchCount);
    }
  }

  void printCosts(Way& way, const Duration& loading) {
    const double bytes = way.numBytes();
    std::string per_face;
    if (const auto* display = dynamic_cast<const DisplayWay*>(&way)) {
      const auto faces = static_cast<double>(display->scene().counts(FaceSet::kOccupied).faces);
      per_face = std::to_string(static_cast<int>(bytes / faces));
    }
    double uploaded_bytes = 0.0;
    const Duration delay = measureDelay(way, uploaded_bytes);
    std::printf("| cost | %.0f | %s | %.2f | %.2f | %.0f | %s | %.0f | %.0f | %.2f |\n", num_boxes_,
                way.name(), loading.wall_s, loading.cpu_s, bytes / num_boxes_, per_face.c_str(),
                1e3 * delay.wall_s, 1e3 * delay.cpu_s, 1e-6 * uploaded_bytes);
    if (auto* display = dynamic_cast<DisplayWay*>(&way)) printUploadOfSettings(*display);
    std::fflush(stdout);
  }

  /// From a message to the first picture that differs.
  Duration measureDelay(Way& way, double& uploaded_bytes) {
    window_.look(views_.front().distance_m, 0.7, 0.7);
    window_.update();
    const std::vector<unsigned char> before = window_.readPixels();
    const auto x =
        static_cast<std::int32_t>(32 * runners_.size());  // Each way finds untouched ground.
    const CellBox place{{x - 8, -8, 0}, {x + 8, 8, 40}};
    ChangeSet changes = map_.replace(place, {{place, 1.0F}});
    const double bytes_before = way.numUploadedBytes();
    const Stopwatch stopwatch;
    const std::optional<double> sent_bytes = way.send(map_, changes);
    window_.updateUntil([&] { return window_.readPixels() != before; }, kPatience_s);
    const Duration delay = stopwatch.elapsed();
    uploaded_bytes = sent_bytes.value_or(way.numUploadedBytes() - bytes_before);
    changes = map_.replace(place, std::vector<UniformBox>());
    way.send(map_, changes);
    return delay;
  }

  void printUploadOfSettings(DisplayWay& display) {
    for (int i = 0; i < 20; ++i) window_.update();
    const double before = display.numUploadedBytes();
    for (const char* mode : {"Probability", "Cuboid size", "Class", "Height"}) {
      display.set({"Color by"}, mode);
      window_.update();
    }
    display.set({"Occupied", "Alpha"}, 0.5);
    window_.update();
    display.set({"Occupied", "Alpha"}, 1.0);
    for (const bool is_on : {true, false}) {
      display.set({"Height range"}, is_on);
      window_.update();
    }
    std::printf("Uploaded for color, alpha and heights: %.0f bytes\n",
                display.numUploadedBytes() - before);
  }

  test::RvizWindow& window_;
  CuboidMap map_;
  std::vector<View> views_;
  std::vector<Runner> runners_;
  double num_boxes_ = 0.0;
};

/// What to measure.
struct Options {
  std::vector<double> boxes{1e4, 1e5, 1e6};
  std::vector<std::string> maps;
  bool is_display_only = false;
  double updates_min = 0.0;
};

void compare(const Options& options) {
  test::RvizWindow window({1280, 720});
  std::printf(
      "| frame | boxes | view | shown by | turned: frames/s | CPU of one (ms) | still: frames/s | "
      "CPU "
      "of one (ms) | longest turned beyond a still one (CPU ms) | triangles: turned | still | draw "
      "calls |\n"
      "| cost | boxes | shown by | until drawn (s) | CPU (s) | bytes/box | bytes/face | change to "
      "picture (ms) "
      "| CPU (ms) | uploaded for it (MB) |\n");
  for (const std::string& map : options.maps) {
    Comparison(window, loadMap(map)).run(options.is_display_only);
  }
  if (!options.maps.empty()) return;
  for (const double num_boxes : options.boxes) {
    Comparison(window, makeGround(num_boxes)).run(options.is_display_only);
  }
}

int run(int argc, char** argv) {
  Options options;
  CommandLine command_line(
      "display_frames",
      "Measures the display for rviz against the marker topics and against a cloud of "
      "boxes, as other maps are shown, in one window. Needs a screen and a roscore. Prints "
      "tables in Markdown.");
  command_line.addList("boxes", options.boxes, "numbers of boxes of the ground, such as 1e4,1e5",
                       {1.0, 1e8});
  command_line.addTexts("map", options.maps, "show these map files instead of the ground");
  command_line.addFlag("display-only", options.is_display_only, "show only the display");
  command_line.addNumber("updates", options.updates_min,
                         "measure memory for so many minutes, while a map of 100,000 boxes changes "
                         "up to ten times a second",
                         {0.0, 1e4});
  ros::init(argc, argv, "display_frames", ros::init_options::AnonymousName);
  if (const auto status = command_line.parse(argc, argv)) return *status;
  const ros::NodeHandle nh;
  if (options.updates_min > 0.0) return followUpdates(options.updates_min);
  compare(options);
  return 0;
}

}  // namespace
}  // namespace cuboid_mapping_rviz::bench

int main(int argc, char** argv) {
  return cuboid_mapping::runProgram("display_frames",
                                    [&] { return cuboid_mapping_rviz::bench::run(argc, argv); });
}
