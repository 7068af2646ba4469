// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/map/map_follower.h"

#include "cuboid_mapping/rtree/traversal.h"

#include <cmath>
#include <unordered_set>

namespace cuboid_mapping {
namespace {

/// Edge of the largest box of a delta: offsets in it fit into a byte.
constexpr std::int32_t kTileEdge = 128;

void append(const CellBox& box, std::vector<std::int32_t>& numbers) {
  numbers.insert(numbers.end(), {box.min.x, box.min.y, box.min.z, box.max.x, box.max.y, box.max.z});
}

/// The boxes of a change set without those that come again, cut into tiles. Most are bricks.
std::vector<CellBox> makeTiles(const ChangeSet& changes) {
  std::unordered_set<Cell, CellHash> bricks;
  std::vector<CellBox> tiles;
  for (const CellBox& box : changes.boxes) {
    if (box == brickBox(brickOf(box.min))) {
      if (bricks.insert(box.min).second) tiles.push_back(box);
      continue;
    }
    for (std::int32_t z = box.min.z; z < box.max.z; z += kTileEdge) {
      for (std::int32_t y = box.min.y; y < box.max.y; y += kTileEdge) {
        for (std::int32_t x = box.min.x; x < box.max.x; x += kTileEdge) {
          tiles.push_back(
              intersect({{x, y, z}, {x + kTileEdge, y + kTileEdge, z + kTileEdge}}, box));
        }
      }
    }
  }
  return tiles;
}

void appendCuboids(const CuboidMap& map, const CellBox& tile, MapDelta& delta) {
  const std::size_t before = delta.log_odds.size();
  visitBox(map.tree(), tile, CuboidFilter::kAll, [&](const Cuboid& cuboid) {
    const CellBox part = intersect(cuboid.box, tile);
    for (const Cell& corner : {part.min - tile.min, part.max - tile.min}) {
      for (int axis = 0; axis < 3; ++axis) {
        delta.offsets.push_back(static_cast<std::uint8_t>(corner[axis]));
      }
    }
    delta.log_odds.push_back(cuboid.log_odds);
    return Visit::kContinue;
  });
  append(tile, delta.boxes);
  delta.counts.push_back(static_cast<std::uint32_t>(delta.log_odds.size() - before));
}

CellBox boxAt(const std::vector<std::int32_t>& numbers, std::size_t index) {
  const std::int32_t* at = &numbers[6 * index];
  return {{at[0], at[1], at[2]}, {at[3], at[4], at[5]}};
}

bool isGood(double resolution_m) { return std::isfinite(resolution_m) && resolution_m > 0.0; }

bool isGood(const Cuboid& cuboid, const CellBox& box) {
  return !cuboid.box.isEmpty() && box.contains(cuboid.box) && std::isfinite(cuboid.log_odds);
}

/// A box of a delta, and what is in it.
struct Content {
  CellBox box;
  std::vector<Cuboid> cuboids;
};

/// Nothing when the arrays do not fit together.
std::optional<std::vector<Content>> decode(const MapDelta& delta) {
  const std::size_t num_boxes = delta.counts.size();
  const std::size_t num_cuboids = delta.log_odds.size();
  if (delta.boxes.size() != 6 * num_boxes || delta.offsets.size() != 6 * num_cuboids) {
    return std::nullopt;
  }
  std::vector<Content> contents;
  contents.reserve(num_boxes);
  std::size_t next = 0;
  for (std::size_t i = 0; i < num_boxes; ++i) {
    contents.push_back({boxAt(delta.boxes, i), {}});
    Content& content = contents.back();
    if (content.box.isEmpty() || !kAllCells.contains(content.box)) return std::nullopt;
    if (delta.counts[i] > num_cuboids - next) return std::nullopt;
    for (const std::size_t end = next + delta.counts[i]; next < end; ++next) {
      const std::uint8_t* at = &delta.offsets[6 * next];
      const Cell& origin = content.box.min;
      content.cuboids.push_back(
          {{origin + Cell{at[0], at[1], at[2]}, origin + Cell{at[3], at[4], at[5]}},
           delta.log_odds[next]});
      if (!isGood(content.cuboids.back(), content.box)) return std::nullopt;
    }
  }
  if (next != num_cuboids) return std::nullopt;
  return contents;
}

}  // namespace

MapImage makeImage(const CuboidMap& map, std::uint64_t instance) {
  MapImage image{instance, map.revision(), map.grid().resolution(), {}, {}};
  image.bounds.reserve(6 * map.tree().size());
  image.log_odds.reserve(map.tree().size());
  visitAll(map.tree(), CuboidFilter::kAll, [&image](const Cuboid& cuboid) {
    append(cuboid.box, image.bounds);
    image.log_odds.push_back(cuboid.log_odds);
    return Visit::kContinue;
  });
  return image;
}

MapDelta makeDelta(const CuboidMap& map, const ChangeSet& changes, std::uint64_t instance,
                   std::uint64_t base) {
  MapDelta delta;
  delta.instance = instance;
  delta.base = base;
  delta.revision = map.revision();
  delta.is_everything = changes.is_everything;
  delta.resolution_m = map.grid().resolution();
  if (changes.is_everything) return delta;
  for (const CellBox& tile : makeTiles(changes)) appendCuboids(map, tile, delta);
  return delta;
}

bool MapFollower::take(const MapImage& image) {
  if (map_ && image.instance == instance_ && image.revision < revision_) return true;
  if (!isGood(image.resolution_m) || image.bounds.size() != 6 * image.log_odds.size()) return false;
  std::vector<Cuboid> cuboids;
  cuboids.reserve(image.log_odds.size());
  for (std::size_t i = 0; i < image.log_odds.size(); ++i) {
    cuboids.push_back({boxAt(image.bounds, i), image.log_odds[i]});
    if (!isGood(cuboids.back(), kAllCells)) return false;
  }
  MapConfig config;
  config.resolution_m = image.resolution_m;
  map_.emplace(config);
  map_->replace(kAllCells, cuboids);
  instance_ = image.instance;
  revision_ = image.revision;
  return true;
}

FollowResult MapFollower::take(const MapDelta& delta) {
  if (!map_ || delta.instance != instance_) return FollowResult::kGap;
  if (delta.revision <= revision_) return FollowResult::kOld;
  if (delta.base > revision_ || delta.is_everything) return FollowResult::kGap;
  const auto contents = decode(delta);
  if (!contents || delta.resolution_m != map_->grid().resolution()) return FollowResult::kDamaged;
  for (const Content& content : *contents) map_->replace(content.box, content.cuboids);
  revision_ = delta.revision;
  return FollowResult::kApplied;
}

}  // namespace cuboid_mapping
