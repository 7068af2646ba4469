// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/io/brick_codec.h"

#include "cuboid_mapping/geometry/grid.h"
#include "cuboid_mapping/map/progress_counter.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <unordered_set>

namespace cuboid_mapping {
namespace {

std::vector<float> collectLogOdds(const VoxelBrick* first, const VoxelBrick* last) {
  std::unordered_set<float> values;
  for (const VoxelBrick* brick = first; brick != last; ++brick) {
    brick->voxels.forEachValue([&](float log_odds, const BrickMask&) { values.insert(log_odds); });
  }
  std::vector<float> sorted(values.begin(), values.end());
  std::sort(sorted.begin(), sorted.end());
  return sorted;
}

/// Writes, for each known voxel, the index of its log-odds in the list.
void writeIndices(const PackedVoxels& voxels, const std::vector<float>& log_odds,
                  ByteWriter& bytes) {
  std::array<std::uint32_t, kBrickVoxels> places{};
  voxels.forEachValue([&](float value, const BrickMask& of_value) {
    const auto place = std::lower_bound(log_odds.begin(), log_odds.end(), value);
    const auto number = static_cast<std::uint32_t>(place - log_odds.begin());
    of_value.forEach([&](int voxel) { places[static_cast<std::size_t>(voxel)] = number; });
  });
  voxels.known().forEach(
      [&](int voxel) { bytes.writeVarint(places[static_cast<std::size_t>(voxel)]); });
}

std::vector<VoxelBrick> decodePlaces(std::size_t num_bricks, ByteReader& bytes) {
  std::vector<VoxelBrick> bricks(num_bricks);
  for (int axis = 0; axis < 3; ++axis) {
    DifferenceReader numbers(bytes);
    for (VoxelBrick& brick : bricks) brick.brick[axis] = numbers.readBrickPlace();
  }
  return bricks;
}

}  // namespace

std::size_t encodeBricks(const VoxelBrick* first, const VoxelBrick* last, bool has_values,
                         ByteWriter& bytes, const ProgressListener& listener) {
  const std::vector<float> log_odds =
      has_values ? collectLogOdds(first, last) : std::vector<float>();
  for (const float value : log_odds) bytes.writeF32(value);
  for (int axis = 0; axis < 3; ++axis) {
    DifferenceWriter numbers(bytes);
    std::for_each(first, last,
                  [&](const VoxelBrick& brick) { numbers.write(brick.brick[axis] / kBrickEdge); });
  }
  std::for_each(first, last,
                [&](const VoxelBrick& brick) { writeMask(brick.voxels.known(), bytes); });
  ProgressCounter progress(listener, static_cast<std::uint64_t>(last - first));
  std::for_each(first, last, [&](const VoxelBrick& brick) {
    has_values ? writeIndices(brick.voxels, log_odds, bytes)
               : writeMask(brick.voxels.occupied(), bytes);
    progress.advance();
  });
  return log_odds.size();
}

std::vector<VoxelBrick> decodeBricks(std::size_t num_bricks, std::size_t num_log_odds,
                                     bool has_values, ByteReader& bytes) {
  static const SensorModel kModel;
  const std::vector<float> log_odds = decodeLogOdds(num_log_odds, bytes);
  std::vector<VoxelBrick> bricks = decodePlaces(num_bricks, bytes);
  std::vector<BrickMask> known(bricks.size());
  for (BrickMask& mask : known) mask = readMask(bytes);
  for (std::size_t i = 0; i < bricks.size(); ++i) {
    if (!has_values) {
      bricks[i].voxels = PackedVoxels::ofClasses(known[i], readMask(bytes), kModel);
      continue;
    }
    VoxelValues values;
    known[i].forEach(
        [&](int voxel) { values[static_cast<std::size_t>(voxel)] = readLogOdds(log_odds, bytes); });
    bricks[i].voxels = PackedVoxels(known[i], values);
  }
  return bricks;
}

void writeMask(const BrickMask& mask, ByteWriter& bytes) {
  for (int z = 0; z < kBrickEdge; ++z) bytes.writeU64(mask[z]);
}

BrickMask readMask(ByteReader& bytes) {
  BrickMask mask;
  for (int z = 0; z < kBrickEdge; ++z) mask[z] = bytes.readU64();
  return mask;
}

std::vector<float> decodeLogOdds(std::size_t count, ByteReader& bytes) {
  std::vector<float> log_odds(count);
  for (float& value : log_odds) {
    value = bytes.readF32();
    if (!std::isfinite(value)) failCorrupted("a voxel has log-odds that are not finite");
  }
  return log_odds;
}

float readLogOdds(const std::vector<float>& log_odds, ByteReader& bytes) {
  const std::uint32_t index = bytes.readVarint();
  if (index >= log_odds.size()) failCorrupted("a voxel refers to log-odds that are not there");
  return log_odds[index];
}

std::int32_t toBrickPlace(std::int64_t place) {
  if (place % kBrickEdge != 0 || place < -Grid::kMaxCell || place >= Grid::kMaxCell) {
    failCorrupted("a brick lies outside the limits of a map");
  }
  return static_cast<std::int32_t>(place);
}

std::int32_t DifferenceReader::read() {
  number_ += fromZigzag(bytes_.readVarint());
  if (number_ < -Grid::kMaxCell || number_ >= Grid::kMaxCell) {
    failCorrupted("it reaches beyond the limits of a map");
  }
  return static_cast<std::int32_t>(number_);
}

}  // namespace cuboid_mapping
