// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/io/scan_dataset.h"

#include <octomap/ScanGraph.h>
#include <pcl/conversions.h>
#include <pcl/io/pcd_io.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>

namespace cuboid_mapping {
namespace {

namespace fs = std::filesystem;

/// A folder with poses.txt and scans/NNNN.pcd.
class ScanFolder : public ScanDataset {
 public:
  explicit ScanFolder(fs::path folder) : folder_(std::move(folder)) {
    const fs::path file = folder_ / "poses.txt";
    std::ifstream in(file);
    if (!in) throw std::runtime_error("cannot open " + file.string());
    std::string line;
    for (int number = 1; std::getline(in, line); ++number) {
      if (line.find_first_not_of(" \t\r") == std::string::npos || line[0] == '#') continue;
      std::istringstream words(line);
      int index = 0;
      Eigen::Vector3d t;
      Eigen::Quaterniond q;
      if (!(words >> index >> t.x() >> t.y() >> t.z() >> q.x() >> q.y() >> q.z() >> q.w()) ||
          !(q.norm() > 0.5)) {
        throw std::runtime_error(file.string() + ":" + std::to_string(number) +
                                 ": expected 'index tx ty tz qx qy qz qw'");
      }
      poses_.push_back({index, Eigen::Translation3d(t) * q.normalized()});
    }
    if (poses_.empty()) throw std::runtime_error(file.string() + " holds no pose");
  }

  [[nodiscard]] std::size_t size() const override { return poses_.size(); }

  [[nodiscard]] Item read(std::size_t index) const override {
    char name[32];
    std::snprintf(name, sizeof(name), "%04d.pcd", poses_.at(index).index);
    const fs::path file = folder_ / "scans" / name;
    pcl::PointCloud<pcl::PointXYZ> cloud;
    if (!fs::exists(file) || pcl::io::loadPCDFile(file.string(), cloud) != 0) {
      throw std::runtime_error("cannot read " + file.string() + " as a PCD file with x y z");
    }
    Item item;
    item.T_map_sensor = poses_[index].T_map_sensor;
    item.points_sensor.reserve(cloud.size());
    for (const pcl::PointXYZ& point : cloud)
      item.points_sensor.emplace_back(point.getVector3fMap());
    return item;
  }

 private:
  struct Pose {
    int index;
    Eigen::Isometry3d T_map_sensor;
  };

  fs::path folder_;
  std::vector<Pose> poses_;
};

/// A folder pcd/ of clouds in the map's frame, whose VIEWPOINT is where the sensor was.
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
    const std::string file = files_.at(index).string();
    pcl::PCLPointCloud2 content;
    Eigen::Vector4f origin;
    Eigen::Quaternionf orientation;
    int version = 0;
    pcl::PointCloud<pcl::PointXYZ> cloud;
    if (pcl::PCDReader().read(file, content, origin, orientation, version) != 0 ||
        !(orientation.norm() > 0.5F) || pcl::getFieldIndex(content, "z") < 0) {
      throw std::runtime_error("cannot read " + file + " as a PCD file with x y z and VIEWPOINT");
    }
    pcl::fromPCLPointCloud2(content, cloud);
    Item item;
    item.T_map_sensor = Eigen::Translation3d(origin.head<3>().cast<double>()) *
                        orientation.cast<double>().normalized();
    const Eigen::Isometry3d T_sensor_map = item.T_map_sensor.inverse();
    item.points_sensor.reserve(cloud.size());
    for (const pcl::PointXYZ& point : cloud) {
      item.points_sensor.emplace_back(
          (T_sensor_map * point.getVector3fMap().cast<double>()).cast<float>());
    }
    return item;
  }

 private:
  std::vector<fs::path> files_;
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
  if (fs::is_directory(path)) return std::make_unique<ScanFolder>(path);
  throw std::runtime_error(path + " is neither a folder with poses.txt or pcd/ nor a .graph file");
}

}  // namespace cuboid_mapping
