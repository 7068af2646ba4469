// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/io/pcd_file.h"

#include "cuboid_mapping/geometry/grid.h"
#include "cuboid_mapping/io/text.h"
#include "cuboid_mapping/voxels/uniform_boxes.h"

#include <pcl/PCLPointCloud2.h>
#include <pcl/common/io.h>
#include <pcl/io/pcd_io.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>

namespace cuboid_mapping {
namespace {

constexpr std::array<const char*, 11> kKeys{"VERSION",   "FIELDS", "COLUMNS", "SIZE",
                                            "TYPE",      "COUNT",  "WIDTH",   "HEIGHT",
                                            "VIEWPOINT", "POINTS", "DATA"};

[[noreturn]] void refuse(const std::string& file, const std::string& what) {
  throw std::runtime_error("cannot read " + file + " as a PCD file: " + what);
}

struct PcdHeader {
  /// In double: PCL's own has the precision of float only.
  Eigen::Isometry3d viewpoint = Eigen::Isometry3d::Identity();
  bool is_ascii = false;
};

/// Reads a header up to its end. At a key that PCL does not know, it takes the header for points, or crashes; it also
/// crashes at a negative COUNT.
PcdHeader readHeader(const std::string& file, std::istream& in) {
  PcdHeader header;
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    std::istringstream words(line);
    std::string key;
    if (!(words >> key) || key.front() == '#') continue;
    const auto is_key = [&key](const char* known) { return key.rfind(known, 0) == 0; };
    if (std::none_of(kKeys.begin(), kKeys.end(), is_key)) {
      refuse(file, "line " + std::to_string(number) + " is not one of a PCD header");
    }
    if (is_key("COUNT") && line.find('-') != std::string::npos) {
      refuse(file, "its COUNT is negative");
    }
    if (is_key("DATA")) {
      header.is_ascii = words >> key && key == "ascii";
      return header;
    }
    if (!is_key("VIEWPOINT")) continue;
    Eigen::Vector3d t;
    Eigen::Quaterniond q;
    words >> t.x() >> t.y() >> t.z() >> q.w() >> q.x() >> q.y() >> q.z();
    if (!words || !(q.norm() > 0.5)) refuse(file, "its VIEWPOINT is invalid");
    header.viewpoint = Eigen::Translation3d(t) * q.normalized();
  }
  refuse(file, "its header has no DATA");
}

/// Refuses rows of text that PCL would make points at the origin of, cut off at a decimal comma, or leave out.
void checkRows(const std::string& file, std::istream& in, const pcl::PCLPointCloud2& content) {
  std::size_t num_words = 0;
  for (const pcl::PCLPointField& field : content.fields) num_words += field.count;
  std::size_t num_rows = 0;
  for (std::string line; std::getline(in, line);) {
    const std::size_t count = wordsOf(line).size();
    if (count == 0) continue;
    ++num_rows;
    if (count == num_words && line.find(',') == std::string::npos) continue;
    refuse(file, "point " + std::to_string(num_rows) + " must be " + counted(num_words, "number") +
                     " with decimal points");
  }
  const std::size_t num_points = std::size_t{content.width} * content.height;
  if (num_rows == num_points) return;
  refuse(file, "its POINTS are " + std::to_string(num_points) + ", but it has " +
                   std::to_string(num_rows));
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
  if (!std::filesystem::is_regular_file(file)) refuse(file, "there is no such file");
  std::ifstream in(file, std::ios::binary);
  const PcdHeader header = readHeader(file, in);
  pcl::PCLPointCloud2 content;
  Eigen::Vector4f origin;
  Eigen::Quaternionf orientation;
  int version = 0;
  if (pcl::PCDReader().read(file, content, origin, orientation, version) != 0) {
    refuse(file, "its header or its data is damaged");
  }
  if (header.is_ascii) checkRows(file, in, content);
  PcdFile pcd;
  pcd.viewpoint = header.viewpoint;
  pcd.points.resize(std::size_t{content.width} * content.height);
  if (!readAxis(content, "x", 0, pcd.points) || !readAxis(content, "y", 1, pcd.points) ||
      !readAxis(content, "z", 2, pcd.points)) {
    refuse(file, "x, y and z must be there, as numbers of TYPE F and SIZE 4 or 8");
  }
  return pcd;
}

MapSnapshot readPointCloudMap(const std::string& file, double resolution_m,
                              const SensorModelConfig& model) {
  const Grid grid(resolution_m);
  const float log_odds = SensorModel(model, Environment::kDynamic).max();
  std::vector<UniformBox> boxes;
  for (const Eigen::Vector3d& point : readPcd(file).points) {
    const auto cell = point.allFinite() ? grid.toCell(point) : std::nullopt;
    if (cell) boxes.push_back({CellBox::ofCell(*cell), log_odds});
  }
  if (boxes.empty()) throw std::runtime_error(file + " has no point that a map can hold");
  MapSnapshot snapshot;
  snapshot.resolution_m = resolution_m;
  snapshot.sensor_model = model;
  snapshot.bricks = toBricks(boxes).bricks;
  return snapshot;
}

void cuboid_mapping_read_point_cloud_map(const std::string& file, double resolution_m,
                                         const SensorModelConfig& model, MapSnapshot& snapshot) {
  snapshot = readPointCloudMap(file, resolution_m, model);
}

}  // namespace cuboid_mapping
