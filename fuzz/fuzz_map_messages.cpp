// SPDX-License-Identifier: BSD-3-Clause
// Messages of maps and of their changes from a network, and their followers.
#include "cuboid_mapping/io/packed_bricks.h"

#include "fuzz_input.h"
#include "fuzz_target.h"

#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace {

using namespace cuboid_mapping;
using Bricks = std::vector<VoxelBrick>;

std::vector<std::uint8_t> deflate(const std::string& bytes) {
  std::vector<std::uint8_t> deflated(compressBound(bytes.size()));
  uLongf size = deflated.size();
  compress2(deflated.data(), &size, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size(), 1);
  deflated.resize(size);
  return deflated;
}

PackedBricks takePacked(FuzzInput& input) {
  PackedBricks packed;
  packed.num_bricks =
      input.chance() ? static_cast<std::uint32_t>(input.upTo(4)) : input.take<std::uint32_t>();
  packed.num_values =
      input.chance() ? static_cast<std::uint32_t>(input.upTo(8)) : input.take<std::uint32_t>();
  packed.has_values = input.chance();
  const bool is_whole = input.upTo(3) != 0;
  const std::string data = input.rest();
  packed.data = is_whole ? deflate(data) : std::vector<std::uint8_t>(data.begin(), data.end());
  return packed;
}

/// Random bricks, which may be valid.
Bricks takeBricks(FuzzInput& input) {
  Bricks bricks(input.upTo(4));
  for (VoxelBrick& brick : bricks) {
    for (int axis = 0; axis < 3; ++axis) {
      brick.brick[axis] =
          input.upTo(7) == 0 ? input.take<std::int32_t>() : 8 * (input.take<std::int8_t>() / 32);
    }
    BrickMask known;
    for (int z = 0; z < kBrickEdge; ++z) known[z] = input.take<std::uint64_t>();
    const auto log_odds = static_cast<float>(input.number());
    brick.voxels = PackedVoxels(known, std::isnan(log_odds) ? 0.0F : log_odds);
  }
  return bricks;
}

bool isSame(const Bricks& a, const Bricks& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const VoxelBrick& one, const VoxelBrick& other) {
                      return one.brick == other.brick && one.voxels == other.voxels;
                    });
}

/// A copy takes the map and its changes, or reports why not; it can send on the content.
void follow(const Bricks& bricks, const MapDelta& like) {
  MapFollower follower;
  const bool is_taken =
      follower.take(MapImage{like.instance, like.base, like.resolution_m, like.detail, bricks});
  MapDelta delta = like;
  delta.bricks = bricks;
  const FollowResult result = follower.take(delta);
  if (!is_taken && result == FollowResult::kApplied) std::abort();
  if (follower.map() == nullptr) return;
  const Bricks sent = makeImage(*follower.map(), 1, MapDetail::kValues).bricks;
  const auto come =
      unpackBricks(packBricks(sent.data(), sent.data() + sent.size(), MapDetail::kValues));
  if (!come || !isSame(*come, sent)) std::abort();
}

}  // namespace

FUZZ_TARGET(fuzz_map_messages) {
  FuzzInput input(data, size);
  MapDelta delta;
  delta.instance = 1;
  delta.base = input.upTo(2);
  delta.revision = input.upTo(3);
  delta.is_everything = input.upTo(7) == 0;
  delta.resolution_m = input.upTo(7) == 0 ? input.number() : 0.1;
  if (input.chance()) {
    follow(takeBricks(input), delta);
  } else if (const auto bricks = unpackBricks(takePacked(input))) {
    follow(*bricks, delta);
  }
  return 0;
}
