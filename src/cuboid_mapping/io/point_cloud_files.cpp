// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/io/point_cloud_files.h"

#include "cuboid_mapping/io/byte_stream.h"
#include "cuboid_mapping/io/map_file_error.h"
#include "cuboid_mapping/map/progress_counter.h"

#include <algorithm>
#include <fstream>
#include <limits>

namespace cuboid_mapping {
namespace {

std::size_t countPoints(const MapSnapshot& snapshot) {
  std::size_t num_points = 0;
  for (const VoxelBrick& brick : snapshot.bricks) {
    num_points += static_cast<std::size_t>(brick.voxels.occupied().count());
  }
  return num_points;
}

/// Whether float32 resolves the centres of voxels to a hundredth of an edge.
bool isFloatPrecise(const MapSnapshot& snapshot) {
  constexpr std::int32_t kMaxCell = (1 << std::numeric_limits<float>::digits) / 100;
  constexpr CellBox kPrecise{{-kMaxCell, -kMaxCell, -kMaxCell}, {kMaxCell, kMaxCell, kMaxCell}};
  return std::all_of(snapshot.bricks.begin(), snapshot.bricks.end(), [&](const VoxelBrick& brick) {
    return kPrecise.contains(brickBox(brick.brick));
  });
}

/// Header of both formats: rows of three little-endian coordinates and a float follow.
std::string makeHeader(PointCloudFormat format, std::size_t num_points, bool is_float) {
  const std::string count = std::to_string(num_points);
  if (format == PointCloudFormat::kPly) {
    return "ply\nformat binary_little_endian 1.0\nelement vertex " + count +
           (is_float ? "\nproperty float x\nproperty float y\nproperty float z"
                     : "\nproperty double x\nproperty double y\nproperty double z") +
           "\nproperty float intensity\nend_header\n";
  }
  const std::string sizes = is_float ? "4 4 4 4" : "8 8 8 4";
  return "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z intensity\nSIZE " +
         sizes + "\nTYPE F F F F\nCOUNT 1 1 1 1\nWIDTH " + count +
         "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " + count + "\nDATA binary\n";
}

}  // namespace

void writePointCloud(const std::string& file, const MapSnapshot& snapshot, PointCloudFormat format,
                     const ProgressListener& listener) {
  std::ofstream out(file, std::ios::binary);
  const bool is_float = isFloatPrecise(snapshot);
  out << makeHeader(format, countPoints(snapshot), is_float);
  const Grid grid(snapshot.resolution_m);
  ProgressCounter progress(listener, snapshot.bricks.size());
  for (const VoxelBrick& brick : snapshot.bricks) {
    ByteWriter rows;
    brick.voxels.occupied().forEach([&](int voxel) {
      const Eigen::Vector3d center = grid.centerOf(CellBox::ofCell(cellAt(brick.brick, voxel)));
      for (int axis = 0; axis < 3; ++axis) {
        is_float ? rows.writeF32(static_cast<float>(center[axis])) : rows.writeF64(center[axis]);
      }
      rows.writeF32(static_cast<float>(toProbability(*brick.voxels.logOddsAt(voxel))));
    });
    out << rows.bytes();
    progress.advance();
  }
  if (!out.flush()) {
    throw MapFileError(
        MapFileDefect::kInaccessible,
        "cannot write " + file + ": the folder is not writable, or the disk is full");
  }
}

}  // namespace cuboid_mapping
