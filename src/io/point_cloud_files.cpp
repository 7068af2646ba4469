// SPDX-License-Identifier: BSD-3-Clause
#include "point_cloud_files.h"

#include "cuboid_mapping/io/map_file_error.h"

#include <pcl/exceptions.h>
#include <pcl/io/pcd_io.h>
#include <pcl/io/ply_io.h>
#include <pcl/point_types.h>

#include <filesystem>
#include <fstream>
#include <system_error>

namespace cuboid_mapping {
namespace {

using Points = pcl::PointCloud<pcl::PointXYZI>;

void addCenters(const Cuboid& cuboid, const Grid& grid, Points& points) {
  const auto probability = static_cast<float>(toProbability(cuboid.log_odds));
  for (std::int32_t z = cuboid.box.min.z; z < cuboid.box.max.z; ++z) {
    for (std::int32_t y = cuboid.box.min.y; y < cuboid.box.max.y; ++y) {
      for (std::int32_t x = cuboid.box.min.x; x < cuboid.box.max.x; ++x) {
        const Eigen::Vector3d center = grid.centerOf(CellBox::ofCell({x, y, z}));
        pcl::PointXYZI point;
        point.getVector3fMap() = center.cast<float>();
        point.intensity = probability;
        points.push_back(point);
      }
    }
  }
}

Points makePoints(MapSnapshot snapshot, const std::string& file, const ProgressListener& listener) {
  sortCuboids(snapshot.cuboids);
  constexpr double kMaxPoints = 1 << 28;
  double num_points = 0.0;
  for (const Cuboid& cuboid : snapshot.cuboids) {
    if (cuboid.occupancy() == Occupancy::kOccupied) num_points += cuboid.box.numVoxels();
  }
  if (num_points > kMaxPoints) {
    throw MapFileError(MapFileDefect::kTooBig,
                       "cannot write " + file + ": more than 2^28 occupied voxels");
  }
  Points points;
  points.reserve(static_cast<std::size_t>(num_points));
  const Grid grid(snapshot.resolution_m);
  ProgressCounter progress(listener, snapshot.cuboids.size());
  for (const Cuboid& cuboid : snapshot.cuboids) {
    if (cuboid.occupancy() == Occupancy::kOccupied) addCenters(cuboid, grid, points);
    progress.advance();
  }
  return points;
}

/// A file without points, which PCL does not write.
std::string makeEmptyFile(PointCloudFormat format) {
  if (format == PointCloudFormat::kPly) {
    return "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\n"
           "property float z\nproperty float intensity\nend_header\n";
  }
  return "VERSION 0.7\nFIELDS x y z intensity\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 1\n"
         "WIDTH 0\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 0\nDATA ascii\n";
}

bool write(const std::string& file, const Points& points, PointCloudFormat format) {
  if (points.empty()) {
    std::ofstream out(file, std::ios::binary);
    out << makeEmptyFile(format) << std::flush;
    return out.good();
  }
  return (format == PointCloudFormat::kPly ? pcl::PLYWriter().write(file, points, true, false)
                                           : pcl::PCDWriter().writeBinary(file, points)) == 0;
}

}  // namespace

void writePointCloud(const std::string& file, MapSnapshot snapshot, PointCloudFormat format,
                     const ProgressListener& listener) {
  const Points points = makePoints(std::move(snapshot), file, listener);
  std::string reason = "the folder is not writable, or the disk is full";
  bool is_written = false;
  try {
    is_written = write(file, points, format);
  } catch (const pcl::PCLException& error) {
    reason = error.what();
  }
  // PCL does not look whether all that it writes arrives.
  constexpr std::size_t kPointBytes = 4 * sizeof(float);
  std::error_code error;
  const auto num_bytes = std::filesystem::file_size(file, error);
  if (!is_written || error || num_bytes < points.size() * kPointBytes) {
    throw MapFileError(MapFileDefect::kInaccessible, "cannot write " + file + ": " + reason);
  }
}

}  // namespace cuboid_mapping
