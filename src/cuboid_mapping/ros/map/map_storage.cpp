// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/map/map_storage.h"

#include "cuboid_mapping/io/file_replacement.h"
#include "cuboid_mapping/io/map_files.h"
#include "cuboid_mapping/io/map_store.h"
#include "cuboid_mapping/io/pcd_file.h"
#include "cuboid_mapping/io/text.h"
#include "cuboid_mapping/map/cuboid_search.h"
#include "cuboid_mapping/ros/map/point_cloud_loader.h"
#include "cuboid_mapping/ros/middleware/tf_lookup.h"
#include "cuboid_mapping/voxels/brick_cuboids.h"
#include "cuboid_mapping/window/map_window.h"

#include <cmath>
#include <exception>
#include <filesystem>
#include <sstream>
#include <stdexcept>
#include <utility>

namespace cuboid_mapping_ros {
namespace {

/// Lets a listener end the work between two steps.
void step(const ProgressListener& listener) {
  if (listener) listener(0, 1);
}

/// Runs work; its exceptions become errors of the answer.
template <typename WorkT>
StorageAnswer guard(const WorkT& work) {
  StorageAnswer answer;
  try {
    work(answer);
  } catch (const std::bad_alloc&) {
    answer.error = "there is not enough memory";
  } catch (const std::exception& exception) {
    answer.error = exception.what();
  }
  return answer;
}

std::string compareResolutions(double of_file_m, double of_map_m, const std::string& file) {
  if (std::abs(of_file_m - of_map_m) <= 1e-9 * of_map_m) return {};
  std::ostringstream text;
  text << file << " has voxels of " << of_file_m << " m, but this map has voxels of " << of_map_m
       << " m: start the node with resolution " << of_file_m << ", or with map_file";
  return text.str();
}

/// Runs work that reads a map; its errors name the limit.
template <typename WorkT>
auto readWithin(const WorkT& work) {
  try {
    return work();
  } catch (const MapFileError& error) {
    if (error.defect() != MapFileDefect::kTooBig) throw;
    throw MapFileError(error.defect(),
                       std::string(error.what()) + ", in the memory of this machine");
  }
}

/// @param resolution_m  Resolution for a cloud, which has none.
MapFile readFileWithin(const std::string& file, double resolution_m, const SensorModelConfig& model,
                       const SnapshotLimits& limits) {
  if (isPointCloudFile(file)) {
    return {MapFormat::kPcd, loadPointCloudMap(file, resolution_m, model),
            std::filesystem::file_size(file)};
  }
  return readWithin([&] { return readMapFile(file, model, limits); });
}

/// Number of cuboids with FusionKind::kClass.
std::size_t countCuboids(const MapSnapshot& snapshot) {
  std::vector<Cuboid> cuboids;
  for (const VoxelBrick& brick : snapshot.bricks) divideBrick(brick, cuboids);
  return cuboids.size();
}

/// @param prepare  (CuboidMap&): prepares the old map for the exchange, or throws.
template <typename PrepareT>
void putInPlace(GuardedMap& map, const MapConfig& config, const MapSnapshot& snapshot,
                const ProgressListener& listener, StorageAnswer& answer, const PrepareT& prepare) {
  step(listener);
  CuboidMap fresh(config);  // Built while the old map is in use, and freed after it.
  restoreSnapshot(snapshot, fresh);
  answer.num_cuboids = countCuboids(fresh).total();
  step(listener);
  map.replaceAll([&](CuboidMap& content) {
    prepare(content);
    followSensorModel(content, fresh);
    return content.exchange(fresh);
  });
}

/// Box around all bricks; empty if there are none.
CellBox boundsOf(const MapSnapshot& snapshot) {
  CellBox bounds;
  for (const VoxelBrick& brick : snapshot.bricks) {
    const CellBox box = brickBox(brick.brick);
    bounds = bounds.isEmpty() ? box : unite(bounds, box);
  }
  return bounds;
}

/// The cube of 16 x 16 x 16 bricks around a brick. A snapshot has the bricks of each one after the other.
CellBox cubeAround(const Cell& brick) {
  constexpr std::int32_t kEdge = 16 * kBrickEdge;
  const Cell min{brick.x & -kEdge, brick.y & -kEdge, brick.z & -kEdge};
  return {min, min + Cell{kEdge, kEdge, kEdge}};
}

/// Merges the bricks of one cube at a time: others read and change the map in between.
void mergeInto(GuardedMap& map, const MapSnapshot& snapshot, MergeRule rule,
               StorageAnswer& answer) {
  const CellBox whole = boundsOf(snapshot);
  MapOverlap overlap;
  for (auto first = snapshot.bricks.begin(); first != snapshot.bricks.end();) {
    const CellBox cube = cubeAround(first->brick);
    const auto end = std::find_if(first, snapshot.bricks.end(), [&](const VoxelBrick& brick) {
      return !cube.contains(brick.brick);
    });
    MapSnapshot added;
    added.resolution_m = snapshot.resolution_m;
    added.bricks.assign(first, end);
    const auto merge = [&](CuboidMap& content) {
      MapSnapshot merged = {content.config().resolution_m, content.config().sensor_model,
                            content.config().environment, "", content.voxels().copyIn(cube)};
      const MapOverlap part = mergeMaps(merged, added, rule);
      overlap.known_to_both += part.known_to_both;
      overlap.other_class += part.other_class;
      overlap.only_in_second += part.only_in_second;
      return content.replace(cube, std::move(merged.bricks));
    };
    map.editIn(cube, merge, whole);
    first = end;
  }
  map.readWhole([&](const CuboidMap& content) {
    const VoxelStore& voxels = content.voxels();
    overlap.only_in_first = voxels.numFreeVoxels() + voxels.numOccupiedVoxels() -
                            overlap.known_to_both - overlap.only_in_second;
    answer.num_cuboids = countCuboids(content).total();
  });
  answer.notes += describe(overlap, rule);
}

}  // namespace

ProgressListener endWhen(const std::atomic<bool>& is_stopping) {
  return [&is_stopping](std::uint64_t /*done*/, std::uint64_t /*total*/) {
    if (!is_stopping) return;
    throw std::runtime_error("cancelled, because the node ends: everything is as it was");
  };
}

SnapshotLimits limitsOfMachine() {
  const auto num_pages = static_cast<std::uint64_t>(std::max(::sysconf(_SC_PHYS_PAGES), 0L));
  return SnapshotLimits::ofMemory(num_pages * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE)));
}

MapSnapshot takeWholeSnapshot(GuardedMap& map, const std::string& frame_id,
                              const SnapshotLimits& limits, const SnapshotLook& look,
                              const ProgressListener& listener) {
  const PageHold hold = map.hold();  // No page is evicted to the disk meanwhile.
  MapSnapshot snapshot;
  std::vector<Cell> pages;
  std::uint64_t num_replaced = 0;
  map.readWithWindow(
      [&](const CuboidMap& content, const ros::Time& stamp, const MapWindow* window) {
        if (look) look(content, stamp, window);
        snapshot = takeSnapshot(content, frame_id);
        if (window != nullptr) pages = window->storedPages();
        num_replaced = map.numReplaced();
      });
  step(listener);
  std::uint64_t num_read = 0;
  for (const Cell& page : pages) {
    map.readWithWindow(
        [&](const auto& /*content*/, const auto& /*stamp*/, const MapWindow* window) {
          if (map.numReplaced() != num_replaced) {
            throw std::runtime_error(
                "the whole map was replaced meanwhile, by another call: call again");
          }
          readWithin([&] { window->addStored(page, limits, snapshot); });
        });
    if (listener) listener(++num_read, pages.size());
  }
  if (!pages.empty()) sortBricks(snapshot.bricks);
  return snapshot;
}

StorageAnswer saveMap(GuardedMap& map, const std::string& frame_id, const std::string& file,
                      const SnapshotLimits& limits, const ProgressListener& listener) {
  return guard([&](StorageAnswer& answer) {
    std::string state;
    bool is_in_memory = true;
    const auto look = [&](const CuboidMap& content, const auto& /*stamp*/,
                          const MapWindow* window) {
      state = map.progress();
      answer.revision = content.revision();
      is_in_memory = window == nullptr || window->figures().num_on_disk_only == 0;
      if (is_in_memory) answer.num_cuboids = countCuboids(content).total();
    };
    MapSnapshot snapshot = takeWholeSnapshot(map, withoutSlash(frame_id), limits, look, listener);
    snapshot.progress = state;
    if (!is_in_memory) answer.num_cuboids = countCuboids(snapshot);
    answer.num_bytes = writeMapFile(file, snapshot, listener);
  });
}

StorageAnswer loadMap(GuardedMap& map, const std::string& file, const SnapshotLimits& limits,
                      const LoadPlacement& placement, const ProgressListener& listener) {
  return guard([&](StorageAnswer& answer) {
    const MapConfig config = map.config();
    step(listener);
    MapFile read = readFileWithin(file, config.resolution_m, config.sensor_model, limits);
    answer.error = compareResolutions(read.snapshot.resolution_m, map.grid().resolution(), file);
    if (!answer.error.empty()) return;
    if (placement.T_map_file) {
      const bool is_exact =
          cuboid_mapping::moveMap(*placement.T_map_file, read.snapshot, config.threads, listener);
      answer.notes = cuboid_mapping::describeMotion(is_exact) + ". ";
    } else if (!placement.frame_id.empty()) {
      answer.notes = describeOtherFrame(read.snapshot.frame_id, placement.frame_id);
    }
    answer.num_bytes = read.num_bytes;
    if (placement.rule) {
      step(listener);
      mergeInto(map, read.snapshot, *placement.rule, answer);
    } else {
      putInPlace(map, config, read.snapshot, listener, answer, [](CuboidMap& /*content*/) {});
    }
  });
}

StorageAnswer moveWholeMap(GuardedMap& map, const VoxelMotion& motion, const SnapshotLimits& limits,
                           const ProgressListener& listener) {
  return guard([&](StorageAnswer& answer) {
    MapConfig config;
    std::vector<CellBox> locked;
    const auto look = [&](const CuboidMap& content, const auto& /*stamp*/, const auto* /*window*/) {
      config = content.config();
      locked = content.lockedBoxes();
      answer.revision = content.revision();
    };
    MapSnapshot snapshot = takeWholeSnapshot(map, "", limits, look, listener);
    Eigen::Isometry3d T_new_old = motion.transform();
    T_new_old.translation() *= config.resolution_m;
    moveMap(T_new_old, snapshot, config.threads, listener);
    putInPlace(map, config, snapshot, listener, answer, [&](CuboidMap& content) {
      if (content.revision() != answer.revision || content.lockedBoxes() != locked) {
        throw std::runtime_error("the map was changed meanwhile, by another call: call again");
      }
      content.setLocked(snapshot.locked);
    });
  });
}

std::string describeOtherFrame(const std::string& of_file, const std::string& of_map) {
  const std::string frame = withoutSlash(of_map);
  if (of_file.empty() || of_file == frame) return {};
  return "the file has a map in '" + of_file + "': its coordinates are taken as those of '" +
         frame + "'. If the frames differ, set frame_id to " + of_file +
         ", or give ~load_map a transform. ";
}

std::string describeRefusal(const Eigen::Isometry3d& T_target_map, double resolution_m) {
  std::ostringstream text;
  text << "the transform does not take voxels to voxels: only turns by multiples of 90 degrees "
          "about the axes with shifts by multiples of "
       << resolution_m << " m are exact. ";
  Eigen::Isometry3d nearest = T_target_map;
  nearest.translation() =
      resolution_m * (T_target_map.translation() / resolution_m).array().round();
  if (VoxelMotion::of(nearest, resolution_m)) {
    text << "The nearest exact one has the translation "
         << cuboid_mapping::toText(nearest.translation()) << ". ";
  }
  text << "Or resample the map: ~save_map, then ~load_map of that file with this transform. Or map "
          "a recording again, with the new poses: bag_to_map";
  return text.str();
}

StartMap findStartMap(const NodeParameters& parameters) {
  if (hasMap(parameters.autosave_file)) return {parameters.autosave_file, true};
  std::error_code ignored;
  if (parameters.map_file.empty() || std::filesystem::exists(parameters.map_file, ignored)) {
    return {parameters.map_file, false};
  }
  throw MapFileError(MapFileDefect::kInaccessible,
                     "cannot read " + parameters.map_file + ": No such file or directory");
}

std::optional<MapSnapshot> readStartMap(const StartMap& start, NodeParameters& parameters) {
  if (start.file.empty()) return std::nullopt;
  const auto version = versionOf(start.file);
  MapFile file = readFileWithin(start.file, parameters.map.resolution_m,
                                parameters.source.sensor_model, limitsOfMachine());
  if (start.is_autosave) {
    const std::string error =
        compareResolutions(file.snapshot.resolution_m, parameters.map.resolution_m, start.file);
    if (!error.empty()) {
      throw MapFileError(MapFileDefect::kForeign, error + "; or name another autosave_file");
    }
  }
  parameters.map.resolution_m = file.snapshot.resolution_m;
  if (start.is_autosave) parameters.autosave_version = version;
  return std::move(file.snapshot);
}

// Opens a store for writing, since unfinished changes have to be rolled back.
bool hasMap(const std::string& file) {
  namespace fs = std::filesystem;
  std::error_code ignored;
  if (file.empty() || !fs::exists(file, ignored)) return false;
  // Of a store that was killed at its beginning, there may be an empty file.
  const bool is_store = formatOfName(file) == MapFormat::kStore || isSqliteFile(file);
  return !is_store || MapStore(file, StoreAccess::kWrite).head();
}

std::string nameBeside(const std::string& file) {
  namespace fs = std::filesystem;
  const fs::path path = file;
  std::error_code ignored;
  for (int number = 2;; ++number) {
    fs::path name = path.parent_path() / path.stem();
    name += "-" + std::to_string(number) + path.extension().string();
    if (!fs::exists(fs::symlink_status(name, ignored))) return name.string();
  }
}

std::string locksFile(const std::string& map_file) { return map_file + ".locks"; }

void saveLocks(const GuardedMap& map, const std::string& map_file) {
  const auto boxes = map.read([](const CuboidMap& content) { return content.lockedBoxes(); });
  std::error_code ignored;
  const bool is_in_map_file = formatOfName(map_file) == MapFormat::kNative;
  if (boxes.empty() || is_in_map_file) {
    std::filesystem::remove(locksFile(map_file), ignored);
    return;
  }
  std::ostringstream text;
  for (const CellBox& box : boxes) {
    for (const Cell& cell : {box.min, box.max})
      text << cell.x << ' ' << cell.y << ' ' << cell.z << ' ';
    text << '\n';
  }
  replaceFile(locksFile(map_file), text.str());
}

std::vector<CellBox> readLocks(const std::string& map_file) {
  const std::string file = locksFile(map_file);
  std::error_code ignored;
  if (!std::filesystem::exists(file, ignored)) return {};
  std::istringstream text(readFile(file));
  std::vector<CellBox> boxes;
  for (std::string line; std::getline(text, line);) {
    std::istringstream numbers(line);
    CellBox box;
    const bool is_box = static_cast<bool>(numbers >> box.min.x >> box.min.y >> box.min.z >>
                                          box.max.x >> box.max.y >> box.max.z);
    if (!is_box || box.isEmpty()) {
      throw MapFileError(MapFileDefect::kCorrupted,
                         file + ": line " + std::to_string(boxes.size() + 1) +
                             " is no box of six numbers: remove it, or the file, to unlock");
    }
    boxes.push_back(box);
  }
  return boxes;
}

void lockAsSaved(GuardedMap& map, const std::string& map_file) {
  const std::vector<CellBox> boxes = readLocks(map_file);
  map.edit([&](CuboidMap& content) {
    for (const CellBox& box : boxes) content.lock(box);
    return ChangeSet{content.revision(), false, {}};
  });
}

std::string describePages(std::size_t num_pages) {
  return counted(num_pages, "part") + " of the map, of 64 x 64 x 64 voxels";
}

std::unique_ptr<MapWindow> makeWindow(const NodeParameters& parameters, CuboidMap& map) {
  const WindowParameters& window = parameters.window;
  if (!window.isOn()) return nullptr;
  // Checked again: a map to start with may come from the command line.
  if (window.keeps() && !parameters.map_file.empty()) {
    throw std::runtime_error(
        "map_file does not go with window/outside: keep, which starts with window/file");
  }
  std::unique_ptr<MapStore> store;
  if (window.keeps()) {
    store = openStoreOf({map.config().resolution_m,
                         map.config().sensor_model,
                         map.config().environment,
                         withoutSlash(parameters.frame_id),
                         {}},
                        window.file);
  }
  return std::make_unique<MapWindow>(window.config, std::move(store), map);
}

}  // namespace cuboid_mapping_ros
