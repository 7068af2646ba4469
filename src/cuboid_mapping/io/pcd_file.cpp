// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/io/pcd_file.h"

#include <pcl/PCLPointCloud2.h>
#include <pcl/common/io.h>
#include <pcl/io/pcd_io.h>

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>
#include <stdexcept>

namespace cuboid_mapping {
namespace {

/// VIEWPOINT in the header of a PCD file, in double: PCL's own has the precision of float only.
std::optional<Eigen::Isometry3d> readViewpoint(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  std::string line;
  while (std::getline(in, line) && line.rfind("DATA", 0) != 0) {
    std::istringstream words(line);
    std::string key;
    Eigen::Vector3d t;
    Eigen::Quaterniond q;
    if (!(words >> key) || key != "VIEWPOINT") continue;
    words >> t.x() >> t.y() >> t.z() >> q.w() >> q.x() >> q.y() >> q.z();
    if (!words || !(q.norm() > 0.5)) return std::nullopt;
    return Eigen::Translation3d(t) * q.normalized();
  }
  return Eigen::Isometry3d::Identity();
}

/// Reads one coordinate of all points. @return Whether there is such a field of float or double.
bool readAxis(const pcl::PCLPointCloud2& content, const char* name, Eigen::Index axis,
              std::vector<Eigen::Vector3d>& points) {
  const int number = pcl::getFieldIndex(content, name);
  if (number < 0) return false;
  const pcl::PCLPointField& field = content.fields[static_cast<std::size_t>(number)];
  const bool is_double = field.datatype == pcl::PCLPointField::FLOAT64;
  if (!is_double && field.datatype != pcl::PCLPointField::FLOAT32) return false;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::uint8_t* data = content.data.data() + i * content.point_step + field.offset;
    float single = 0.0F;
    double value = 0.0;
    if (is_double) {
      std::memcpy(&value, data, sizeof(value));
    } else {
      std::memcpy(&single, data, sizeof(single));
      value = static_cast<double>(single);
    }
    points[i][axis] = value;
  }
  return true;
}

}  // namespace

PcdFile readPcd(const std::string& file) {
  const auto refuse = [&file](const std::string& what) {
    throw std::runtime_error("cannot read " + file + " as a PCD file: " + what);
  };
  pcl::PCLPointCloud2 content;
  Eigen::Vector4f origin;
  Eigen::Quaternionf orientation;
  int version = 0;
  if (!std::filesystem::exists(file)) refuse("there is no such file");
  if (pcl::PCDReader().read(file, content, origin, orientation, version) != 0) {
    refuse("its header or its data is damaged");
  }
  PcdFile pcd;
  pcd.points.resize(std::size_t{content.width} * content.height);
  if (!readAxis(content, "x", 0, pcd.points) || !readAxis(content, "y", 1, pcd.points) ||
      !readAxis(content, "z", 2, pcd.points)) {
    refuse("x, y and z must be there, as numbers of TYPE F and SIZE 4 or 8");
  }
  const auto viewpoint = readViewpoint(file);
  if (!viewpoint) refuse("its VIEWPOINT is invalid");
  pcd.viewpoint = *viewpoint;
  return pcd;
}

}  // namespace cuboid_mapping
