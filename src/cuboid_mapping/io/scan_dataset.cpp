// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/io/scan_dataset.h"

#include "cuboid_mapping/io/pcd_file.h"

#include <octomap/ScanGraph.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <sstream>
#include <stdexcept>

namespace cuboid_mapping {
namespace {

namespace fs = std::filesystem;

constexpr char kPoses[] = "poses.txt";

/// Numbers of each line of a file; comments and empty lines are left out.
/// @param take  Gets the numbers of a line; returns false if they are not as expected.
template <typename TakeT>
void readLines(const fs::path& file, const std::string& expected, const TakeT& take) {
  std::ifstream in(file);
  if (!in) throw std::runtime_error("cannot open " + file.string());
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    if (line.find_first_not_of(" \t\r") == std::string::npos || line[0] == '#') continue;
    std::istringstream words(line);
    const std::vector<double> numbers{std::istream_iterator<double>(words), {}};
    if (!words.eof() || !take(numbers)) {
      throw std::runtime_error(file.string() + ":" + std::to_string(number) + ": expected '" +
                               expected + "'");
    }
  }
}

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
    readLines(folder_ / kPoses, "index tx ty tz qx qy qz qw", [this](const auto& numbers) {
      if (numbers.size() != 8) return false;
      const Eigen::Quaterniond q(numbers[7], numbers[4], numbers[5], numbers[6]);
      if (!(q.norm() > 0.5)) return false;
      poses_.push_back({static_cast<int>(numbers[0]),
                        Eigen::Translation3d(numbers[1], numbers[2], numbers[3]) * q.normalized()});
      return true;
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

/// A folder pcd/ of clouds in the map's frame, whose VIEWPOINT is the pose of the sensor.
class PosedClouds : public ScanDataset {
 public:
  explicit PosedClouds(const fs::path& folder) {
    for (const auto& entry : fs::directory_iterator(folder / "pcd")) {
      if (entry.path().extension() == ".pcd") files_.push_back(entry.path());
    }
    if (files_.empty()) throw std::runtime_error((folder / "pcd").string() + " has no .pcd file");
    std::sort(files_.begin(), files_.end());
  }

  [[nodiscard]] std::size_t size() const override { return files_.size(); }

  [[nodiscard]] Item read(std::size_t index) const override {
    const PcdFile pcd = readPcd(files_.at(index).string());
    return {pcd.viewpoint, toFloats(pcd.viewpoint.inverse(), pcd.points)};
  }

 private:
  std::vector<fs::path> files_;
};

/// Files .bin of a folder, in order of their names; empty without any.
std::vector<fs::path> findBinFiles(const fs::path& folder) {
  for (const fs::path& place :
       {folder, folder / "velodyne", folder / "velodyne_points/data", folder / "scans"}) {
    if (!fs::is_directory(place)) continue;
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(place)) {
      if (entry.path().extension() == ".bin") files.push_back(entry.path());
    }
    std::sort(files.begin(), files.end());
    if (!files.empty()) return files;
  }
  return {};
}

/// Scans in KITTI's format: rows of x, y, z and intensity as float32; poses.txt with a 3 x 4 matrix, row by
/// row, for each, or "index tx ty tz qx qy qz qw".
class BinFolder : public ScanDataset {
 public:
  BinFolder(const fs::path& folder, std::vector<fs::path> files) : files_(std::move(files)) {
    const Eigen::Isometry3d T_camera_sensor = readCalibration(folder / "calib.txt");
    const fs::path file = folder / kPoses;
    readLines(file, "r11 r12 r13 tx r21 ... tz' or 'index tx ty tz qx qy qz qw",
              [&](const std::vector<double>& numbers) {
                const auto pose = toPose(numbers);
                if (pose) poses_.push_back(T_camera_sensor.inverse() * *pose * T_camera_sensor);
                return pose.has_value();
              });
    if (poses_.size() != files_.size()) {
      throw std::runtime_error(file.string() + " has " + std::to_string(poses_.size()) +
                               " poses, but there are " + std::to_string(files_.size()) +
                               " .bin files");
    }
  }

  [[nodiscard]] std::size_t size() const override { return files_.size(); }

  [[nodiscard]] Item read(std::size_t index) const override {
    const fs::path& file = files_.at(index);
    using Row = std::array<float, 4>;
    const auto num_bytes = fs::file_size(file);
    if (num_bytes % sizeof(Row) != 0) {
      throw std::runtime_error("cannot read " + file.string() +
                               ": it must be rows of four float32, x y z intensity");
    }
    std::vector<Row> rows(num_bytes / sizeof(Row));
    std::ifstream in(file, std::ios::binary);
    if (!in.read(reinterpret_cast<char*>(rows.data()), static_cast<std::streamsize>(num_bytes))) {
      throw std::runtime_error("cannot read " + file.string());
    }
    Item item;
    item.T_map_sensor = poses_[index];
    item.points_sensor.reserve(rows.size());
    for (const Row& row : rows) item.points_sensor.emplace_back(row[0], row[1], row[2]);
    return item;
  }

 private:
  static std::optional<Eigen::Isometry3d> toPose(const std::vector<double>& numbers) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    if (numbers.size() == 12) {
      pose.matrix().topRows<3>() =
          Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(numbers.data());
      // Poses are written with six digits.
      pose.linear() = Eigen::Quaterniond(pose.linear()).normalized().toRotationMatrix();
      return pose;
    }
    if (numbers.size() != 8) return std::nullopt;
    const Eigen::Quaterniond q(numbers[7], numbers[4], numbers[5], numbers[6]);
    if (!(q.norm() > 0.5)) return std::nullopt;
    pose = Eigen::Translation3d(numbers[1], numbers[2], numbers[3]) * q.normalized();
    return pose;
  }

  /// Transform "Tr:" from lidar to camera, since KITTI's poses are those of the camera. Without a file:
  /// identity.
  static Eigen::Isometry3d readCalibration(const fs::path& file) {
    std::ifstream in(file);
    std::string line;
    while (std::getline(in, line)) {
      if (line.rfind("Tr:", 0) != 0) continue;
      std::istringstream words(line.substr(3));
      const auto pose = toPose({std::istream_iterator<double>(words), {}});
      if (!pose) throw std::runtime_error(file.string() + ": expected 'Tr:' and 12 numbers");
      return *pose;
    }
    return Eigen::Isometry3d::Identity();
  }

  std::vector<fs::path> files_;
  std::vector<Eigen::Isometry3d> poses_;
};

/// An octomap::ScanGraph, held in memory.
class ScanGraphFile : public ScanDataset {
 public:
  explicit ScanGraphFile(const std::string& file) {
    if (!fs::exists(file) || !graph_.readBinary(file) || graph_.size() == 0) {
      throw std::runtime_error("cannot read " + file + " as an OctoMap scan graph");
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

std::unique_ptr<ScanDataset> openScanDataset(const std::string& path) {
  if (fs::path(path).extension() == ".graph") return std::make_unique<ScanGraphFile>(path);
  if (fs::is_directory(fs::path(path) / "pcd") && !fs::exists(fs::path(path) / "poses.txt")) {
    return std::make_unique<PosedClouds>(path);
  }
  if (fs::is_directory(path)) {
    const std::vector<fs::path> bin_files = findBinFiles(path);
    if (!bin_files.empty()) return std::make_unique<BinFolder>(path, bin_files);
    return std::make_unique<ScanFolder>(path);
  }
  throw std::runtime_error(path + " is neither a folder with poses.txt or pcd/ nor a .graph file");
}

}  // namespace cuboid_mapping
