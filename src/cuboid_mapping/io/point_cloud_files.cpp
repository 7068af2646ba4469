// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/io/point_cloud_files.h"

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

Points makePoints(const MapSnapshot& snapshot, const std::string& file,
                  const ProgressListener& listener) {
  constexpr std::size_t kMaxPoints = 1 << 28;
  std::size_t num_points = 0;
  for (const VoxelBrick& brick : snapshot.bricks) {
    num_points += static_cast<std::size_t>(brick.voxels.occupied().count());
  }
  if (num_points > kMaxPoints) {
    throw MapFileError(MapFileDefect::kTooBig,
                       "cannot write " + file + ": more than 2^28 occupied voxels");
  }
  Points points;
  points.reserve(num_points);
  const Grid grid(snapshot.resolution_m);
  ProgressCounter progress(listener, snapshot.bricks.size());
  for (const VoxelBrick& brick : snapshot.bricks) {
    brick.voxels.occupied().forEach([&](int voxel) {
      pcl::PointXYZI point;
      const CellBox cell = CellBox::ofCell(cellAt(brick.brick, voxel));
      point.getVector3fMap() = grid.centerOf(cell).cast<float>();
      point.intensity = static_cast<float>(toProbability(*brick.voxels.at(voxel)));
      points.push_back(point);
    });
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

void writePointCloud(const std::string& file, const MapSnapshot& snapshot, PointCloudFormat format,
                     const ProgressListener& listener) {
  const Points points = makePoints(snapshot, file, listener);
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
