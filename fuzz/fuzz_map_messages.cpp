// SPDX-License-Identifier: BSD-3-Clause
// Messages of maps and of their changes, as they come over the network, and those who follow them.
#include "cuboid_mapping/io/brick_codec.h"
#include "cuboid_mapping/sharing/map_follower.h"

#include "fuzz_input.h"

#include <zlib.h>

#include <cstdlib>

namespace {

using namespace cuboid_mapping;

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
  packed.num_cuboids =
      input.chance() ? static_cast<std::uint32_t>(input.upTo(8)) : input.take<std::uint32_t>();
  packed.has_values = input.chance();
  packed.values.resize(input.upTo(8));
  for (float& value : packed.values) value = static_cast<float>(input.number());
  const bool is_whole = input.upTo(3) != 0;
  const std::string data = input.rest();
  packed.data = is_whole ? deflate(data) : std::vector<std::uint8_t>(data.begin(), data.end());
  return packed;
}

/// Arrays that nobody has packed: bricks and boxes that may be right.
BrickArrays takeArrays(FuzzInput& input) {
  BrickArrays arrays;
  arrays.has_values = input.chance();
  const std::size_t num_bricks = input.upTo(4);
  for (std::size_t i = 0; i < num_bricks; ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      arrays.bricks.push_back(input.upTo(7) == 0 ? input.take<std::int32_t>()
                                                 : 8 * (input.take<std::int8_t>() / 32));
    }
    arrays.counts.push_back(static_cast<std::uint16_t>(input.upTo(3)));
    for (std::uint16_t k = 0; k < arrays.counts.back(); ++k) {
      for (int side = 0; side < 6; ++side) {
        arrays.bounds.push_back(static_cast<std::uint8_t>(input.upTo(9)));
      }
      arrays.occupied.push_back(static_cast<std::uint8_t>(input.upTo(2)));
    }
  }
  while (!input.isEmpty()) arrays.values.push_back(static_cast<float>(input.number()));
  if (!arrays.has_values) arrays.values.clear();
  return arrays;
}

bool isSame(const BrickArrays& a, const BrickArrays& b) {
  return a.bricks == b.bricks && a.counts == b.counts && a.bounds == b.bounds &&
         a.occupied == b.occupied && a.has_values == b.has_values;
}

/// A copy takes the map and its changes, or says why not; what it takes can be sent on.
void follow(const BrickArrays& content, const MapDelta& like) {
  MapFollower follower;
  MapImage image{like.instance, like.base, like.resolution_m, content};
  const bool is_taken = follower.take(image);
  MapDelta delta = like;
  delta.content = content;
  const FollowResult result = follower.take(delta);
  if (!is_taken && result == FollowResult::kApplied) std::abort();
  if (follower.map() == nullptr) return;
  const MapImage again = makeImage(*follower.map(), 1, MapDetail::kValues);
  MapFollower second;
  if (!second.take(again)) std::abort();
  if (!isSame(makeImage(*second.map(), 1, MapDetail::kValues).content, again.content)) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzInput input(data, size);
  MapDelta delta;
  delta.instance = 1;
  delta.base = input.upTo(2);
  delta.revision = input.upTo(3);
  delta.is_everything = input.upTo(7) == 0;
  delta.resolution_m = input.upTo(7) == 0 ? input.number() : 0.1;
  BrickArrays arrays;
  if (input.chance()) {
    arrays = takeArrays(input);
    BrickArrays back;
    const bool fits = arrays.bounds.size() == 6 * arrays.occupied.size();
    if (!arrays.has_values && fits && (!unpackBricks(packBricks(arrays), back))) std::abort();
  } else if (!unpackBricks(takePacked(input), arrays)) {
    return 0;
  }
  follow(arrays, delta);
  return 0;
}
