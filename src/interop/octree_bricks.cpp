// SPDX-License-Identifier: BSD-3-Clause
#include "octree_bricks.h"

#include <algorithm>
#include <numeric>
#include <unordered_map>

namespace cuboid_mapping {
namespace {

constexpr std::int32_t kCenter = 32768;

std::uint64_t orderOf(const Cell& brick) {
  const auto number = [](std::int32_t v) { return static_cast<std::uint32_t>((v + kCenter) >> 3); };
  return spreadBits(number(brick.x)) | spreadBits(number(brick.y)) << 1 |
         spreadBits(number(brick.z)) << 2;
}

/// Place of a coordinate inside a brick in the order of an octree, for x; y and z are shifted.
constexpr std::array<std::uint16_t, kBrickEdge> kPlaces{0, 1, 8, 9, 64, 65, 72, 73};

/// A cuboid in a brick, found before the bricks have their places.
struct Membership {
  std::uint32_t brick;
  std::uint32_t cuboid;
};

/// Numbers bricks as they come.
class BrickNumbers {
 public:
  std::uint32_t numberOf(const Cell& brick) {
    if (!bricks_.empty() && brick == last_brick_) return last_number_;
    const auto [place, is_new] =
        numbers_.emplace(brick, static_cast<std::uint32_t>(bricks_.size()));
    if (is_new) bricks_.push_back(brick);
    last_brick_ = brick;
    last_number_ = place->second;
    return last_number_;
  }
  void reserve(std::size_t num_bricks) { numbers_.reserve(num_bricks); }
  [[nodiscard]] const std::vector<Cell>& bricks() const { return bricks_; }

 private:
  std::unordered_map<Cell, std::uint32_t, CellHash> numbers_;
  std::vector<Cell> bricks_;
  Cell last_brick_;
  std::uint32_t last_number_ = 0;
};

/// Puts the members of each brick side by side (counting sort).
void placeMembers(const std::vector<Membership>& memberships, OctreeBricks& sorted,
                  const std::vector<std::uint32_t>& place_of_number) {
  for (const Membership& member : memberships) ++sorted.bricks[place_of_number[member.brick]].last;
  std::uint32_t end = 0;
  for (OctreeBrick& brick : sorted.bricks) {
    brick.first = end;
    end += brick.last;
    brick.last = brick.first;
  }
  sorted.members.resize(memberships.size());
  for (const Membership& member : memberships) {
    sorted.members[sorted.bricks[place_of_number[member.brick]].last++] = member.cuboid;
  }
}

}  // namespace

OctreeBricks sortIntoBricks(const std::vector<Cuboid>& cuboids) {
  OctreeBricks sorted;
  BrickNumbers numbers;
  std::vector<Membership> memberships;
  memberships.reserve(cuboids.size());
  numbers.reserve(cuboids.size() / 8);
  for (std::uint32_t i = 0; i < cuboids.size(); ++i) {
    const CellBox& box = cuboids[i].box;
    const CellBox inside = intersect(box, kOctreeCells);
    if (inside != box) sorted.num_left_out += box.numVoxels() - inside.numVoxels();
    if (inside.isEmpty()) continue;
    const Cell brick_of_min = brickOf(inside.min);
    if (brickBox(brick_of_min).contains(inside)) {  // nearly all of them
      memberships.push_back({numbers.numberOf(brick_of_min), i});
      continue;
    }
    (void)anyBrick(inside, [&](const Cell& brick) {
      memberships.push_back({numbers.numberOf(brick), i});
      return false;  // on to the next
    });
  }
  std::vector<std::uint64_t> orders;
  orders.reserve(numbers.bricks().size());
  for (const Cell& brick : numbers.bricks()) orders.push_back(orderOf(brick));
  std::vector<std::uint32_t> by_order(orders.size());
  std::iota(by_order.begin(), by_order.end(), 0U);
  std::sort(by_order.begin(), by_order.end(),
            [&](std::uint32_t a, std::uint32_t b) { return orders[a] < orders[b]; });
  std::vector<std::uint32_t> place_of_number(orders.size());
  for (std::uint32_t place = 0; place < by_order.size(); ++place) {
    place_of_number[by_order[place]] = place;
    sorted.bricks.push_back({orders[by_order[place]], 0, 0});
  }
  placeMembers(memberships, sorted, place_of_number);
  return sorted;
}

Cell brickAt(std::uint64_t order) {
  const auto coordinate = [&](int axis) {
    return static_cast<std::int32_t>(gatherBits(order >> axis) << 3) - kCenter;
  };
  return {coordinate(0), coordinate(1), coordinate(2)};
}

void fillVoxels(const Cell& brick, const std::vector<Cuboid>& cuboids, const std::uint32_t* first,
                const std::uint32_t* last, OctreeKind kind, OctreeVoxels& voxels) {
  voxels.known.fill(0);
  for (const std::uint32_t* member = first; member != last; ++member) {
    const Cuboid& cuboid = cuboids[*member];
    const bool is_occupied = cuboid.occupancy() == Occupancy::kOccupied;
    const float value = kind == OctreeKind::kFull ? cuboid.log_odds : (is_occupied ? 1.0F : -1.0F);
    const CellBox part = intersect(cuboid.box, brickBox(brick));
    for (std::int32_t z = part.min.z - brick.z; z < part.max.z - brick.z; ++z) {
      for (std::int32_t y = part.min.y - brick.y; y < part.max.y - brick.y; ++y) {
        const unsigned row =
            kPlaces[static_cast<std::size_t>(z)] << 2U | kPlaces[static_cast<std::size_t>(y)] << 1U;
        for (std::int32_t x = part.min.x - brick.x; x < part.max.x - brick.x; ++x) {
          const unsigned place = row | kPlaces[static_cast<std::size_t>(x)];
          voxels.log_odds[place] = value;
          voxels.known[place / 64] |= 1ULL << (place & 63U);
        }
      }
    }
  }
}

}  // namespace cuboid_mapping
