// SPDX-License-Identifier: BSD-3-Clause
#include "data_sets/scan_dataset.h"

#include "cuboid_mapping/io/pcd_file.h"
#include "data_sets/bin_scans.h"
#include "data_sets/pose_lines.h"

#include <octomap/ScanGraph.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <optional>
#include <stdexcept>
#include <utility>

namespace cuboid_mapping {
namespace {

namespace fs = std::filesystem;

constexpr char kPoses[] = "poses.txt";

std::vector<Eigen::Vector3f> toFloats(const Eigen::Isometry3d& T_sensor_points,
                                      const std::vector<Eigen::Vector3d>& points) {
  std::vector<Eigen::Vector3f> floats;
  floats.reserve(points.size());
  for (const Eigen::Vector3d& point : points) {
    floats.emplace_back((T_sensor_points * point).cast<float>());
  }
  return floats;
}

/// A folder with poses.txt and scans/NNNN.pcd.
class ScanFolder : public ScanDataset {
 public:
  explicit ScanFolder(fs::path folder) : folder_(std::move(folder)) {
    readLines(folder_ / kPoses, kIndexedPose, [this](const auto& numbers) {
      const auto pose = numbers.size() == 8 ? toPose(numbers) : std::nullopt;
      if (pose) poses_.push_back({static_cast<int>(numbers[0]), *pose});
      return pose.has_value();
    });
    if (poses_.empty()) throw std::runtime_error((folder_ / kPoses).string() + " holds no pose");
  }

  [[nodiscard]] std::size_t size() const override { return poses_.size(); }

  [[nodiscard]] Item read(std::size_t index) const override {
    char name[32];
    std::snprintf(name, sizeof(name), "%04d.pcd", poses_.at(index).index);
    const fs::path file = folder_ / "scans" / name;
    return {poses_[index].T_map_sensor,
            toFloats(Eigen::Isometry3d::Identity(), readPcd(file.string()).points)};
  }

 private:
  struct Pose {
    int index;
    Eigen::Isometry3d T_map_sensor;
  };

  fs::path folder_;
  std::vector<Pose> poses_;
};

/// Files of a folder, in the order of their names. Those with fewer letters before the first point come first, as "9.pcd"
/// before "10.pcd".
std::vector<fs::path> findFiles(const fs::path& folder, const char* extension) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() == extension) files.push_back(entry.path());
  }
  const auto order = [](const fs::path& file) {
    const std::string name = file.filename().string();
    return std::pair(name.find('.'), name);
  };
  std::sort(files.begin(), files.end(),
            [&order](const fs::path& a, const fs::path& b) { return order(a) < order(b); });
  return files;
}

/// A folder pcd/ of clouds in the map's frame, whose VIEWPOINT is the pose of the sensor.
class PosedClouds : public ScanDataset {
 public:
  explicit PosedClouds(const fs::path& folder) : files_(findFiles(folder / "pcd", ".pcd")) {
    if (files_.empty()) throw std::runtime_error((folder / "pcd").string() + " has no .pcd file");
  }

  [[nodiscard]] std::size_t size() const override { return files_.size(); }

  [[nodiscard]] Item read(std::size_t index) const override {
    const PcdFile pcd = readPcd(files_.at(index).string());
    return {pcd.viewpoint, toFloats(pcd.viewpoint.inverse(), pcd.points)};
  }

 private:
  std::vector<fs::path> files_;
};

/// Files .bin of a folder; empty without any.
std::vector<fs::path> findBinFiles(const fs::path& folder) {
  for (const fs::path& place :
       {folder, folder / "velodyne", folder / "velodyne_points/data", folder / "scans"}) {
    if (!fs::is_directory(place)) continue;
    std::vector<fs::path> files = findFiles(place, ".bin");
    if (!files.empty()) return files;
  }
  return {};
}

/// Whether a file has all scans that it claims: OctoMap leaves out missing ones, or aborts the program.
bool isWholeGraph(const std::string& file) {
  constexpr std::streamoff kPointBytes = 4 + 3 * 8;
  constexpr std::streamoff kPoseAndIdBytes = kPointBytes + (4 + 4 * 8) + 4;
  std::ifstream in(file, std::ios::binary);
  const auto num_bytes = static_cast<std::streamoff>(fs::file_size(file));
  const auto read_count = [&in] {
    std::uint32_t count = 0;
    in.read(reinterpret_cast<char*>(&count), sizeof(count));
    return count;
  };
  for (std::uint32_t num_left = read_count(); num_left > 0; --num_left) {
    const std::streamoff num_points = read_count();
    in.seekg(kPointBytes * num_points + kPoseAndIdBytes, std::ios::cur);
    if (!in || in.tellg() > num_bytes) return false;
  }
  return static_cast<bool>(in);
}

/// An octomap::ScanGraph, held in memory.
class ScanGraphFile : public ScanDataset {
 public:
  explicit ScanGraphFile(const std::string& file) {
    if (!fs::is_regular_file(file) || !isWholeGraph(file) || !graph_.readBinary(file) ||
        graph_.size() == 0) {
      throw std::runtime_error("cannot read " + file +
                               " as an OctoMap scan graph: it is none, or was cut off");
    }
  }

  [[nodiscard]] std::size_t size() const override { return graph_.size(); }

  [[nodiscard]] Item read(std::size_t index) const override {
    const octomap::ScanNode& node = **(graph_.begin() + static_cast<std::ptrdiff_t>(index));
    const octomath::Vector3& t = node.pose.trans();
    const octomath::Quaternion& q = node.pose.rot();
    Item item;
    item.T_map_sensor = Eigen::Translation3d(t.x(), t.y(), t.z()) *
                        Eigen::Quaterniond(q.u(), q.x(), q.y(), q.z()).normalized();
    item.points_sensor.reserve(node.scan->size());
    for (const octomap::point3d& point : *node.scan) {
      item.points_sensor.emplace_back(point.x(), point.y(), point.z());
    }
    return item;
  }

 private:
  octomap::ScanGraph graph_;
};

}  // namespace

std::unique_ptr<ScanDataset> openScanDataset(const std::string& path, const BinRow& bin_row) {
  if (fs::path(path).extension() == ".graph") return std::make_unique<ScanGraphFile>(path);
  const bool has_poses = fs::exists(fs::path(path) / kPoses);
  if (fs::is_directory(fs::path(path) / "pcd") && !has_poses) {
    return std::make_unique<PosedClouds>(path);
  }
  if (has_poses) {
    const std::vector<fs::path> bin_files = findBinFiles(path);
    if (!bin_files.empty()) return openBinScans(path, bin_files, bin_row);
    return std::make_unique<ScanFolder>(path);
  }
  throw std::runtime_error(path +
                           " is neither a folder of scans, with poses.txt or pcd/, nor a "
                           ".graph file. Rosbags are given by their names, as in " +
                           (fs::path(path) / "*.bag").string());
}

}  // namespace cuboid_mapping
