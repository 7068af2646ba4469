// SPDX-License-Identifier: BSD-3-Clause
// Contents of .cuboids files, and damage to them.
#pragma once

#include "cuboid_mapping/io/native_format.h"
#include "cuboid_mapping/voxels/uniform_boxes.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

namespace cuboid_mapping::test {

// Offsets in the header, from doc/file_format.md.
constexpr std::size_t kVersionAt = 8;
constexpr std::size_t kEnvironmentAt = 12;
constexpr std::size_t kResolutionAt = 16;
constexpr std::size_t kNumBricksAt = 56;
constexpr std::size_t kPayloadBytesAt = 72;
constexpr std::size_t kCompressedBytesAt = 80;
constexpr std::size_t kFrameIdBytesAt = 88;
constexpr std::size_t kFrameIdAt = 92;

/// The header of both golden files, without voxels.
inline MapSnapshot emptySnapshot() {
  MapSnapshot snapshot;
  snapshot.resolution_m = 0.2;
  snapshot.sensor_model = {0.7, 0.4, 0.12, 0.97};
  snapshot.environment = Environment::kStatic;
  snapshot.frame_id = "map";
  return snapshot;
}

/// Content of test/data/version_2.cuboids: see write_version_2.py beside it.
inline MapSnapshot goldenSnapshot() {
  MapSnapshot snapshot = emptySnapshot();
  std::vector<UniformBox> boxes{{{{-8, 0, 8}, {-4, 8, 16}}, -0.5F},
                                {{{0, 0, 0}, {1, 1, 1}}, 0.75F},
                                {{{1, 0, 0}, {8, 1, 1}}, -0.5F},
                                {{{1000000, -1000000, 299}, {1000010, -999999, 300}}, 2.0F}};
  for (int voxel = 0; voxel < kBrickVoxels; ++voxel) {
    if (voxel % 3 == 0) continue;
    const Cell cell = cellAt({-16, -16, -16}, voxel);
    boxes.push_back({CellBox::ofCell(cell), static_cast<float>(voxel - 256) / 64.0F});
  }
  snapshot.bricks = toBricks(boxes).bricks;
  return snapshot;
}

/// Whether bricks are equal, bit by bit.
inline bool isSame(const std::vector<VoxelBrick>& a, const std::vector<VoxelBrick>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const VoxelBrick& one, const VoxelBrick& other) {
                      return one.brick == other.brick && one.voxels == other.voxels;
                    });
}

inline std::string readGolden(const std::string& name) {
  std::ostringstream bytes;
  bytes << std::ifstream(CUBOID_MAPPING_SOURCE_DIR "/test/data/" + name, std::ios::binary).rdbuf();
  EXPECT_GT(bytes.str().size(), 100U) << name;
  return bytes.str();
}

/// Defect of refused bytes; fails if they are accepted.
inline MapFileDefect defectOf(const std::string& bytes, const SnapshotLimits& limits = {}) {
  try {
    (void)fromNativeFormat(bytes, limits);
  } catch (const MapFileError& error) {
    EXPECT_GT(std::strlen(error.what()), 10U);
    return error.defect();
  }
  ADD_FAILURE() << "taken for a map";
  return {};
}

template <typename T>
inline void overwrite(std::string& bytes, std::size_t place, T value) {
  std::memcpy(bytes.data() + place, &value, sizeof(value));
}

/// Corrects the checksum of the header.
inline void sealHeader(std::string& bytes) {
  std::uint32_t frame_id_bytes = 0;
  std::memcpy(&frame_id_bytes, bytes.data() + kFrameIdBytesAt, sizeof(frame_id_bytes));
  const std::size_t end = kFrameIdAt + frame_id_bytes;
  const auto checksum = static_cast<std::uint32_t>(
      crc32(0, reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uInt>(end)));
  overwrite(bytes, end, checksum);
}

}  // namespace cuboid_mapping::test
