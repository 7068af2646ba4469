// SPDX-License-Identifier: BSD-3-Clause
#include "octree_bricks.h"

#include "cuboid_mapping/fusion/dense_brick.h"

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

/// voxelIndex of the voxel at each place of an octree's order.
constexpr std::array<std::uint16_t, kBrickVoxels> makeVoxelTable() {
  std::array<std::uint16_t, kBrickVoxels> table{};
  for (std::uint32_t i = 0; i < kBrickVoxels; ++i) {
    table[i] = static_cast<std::uint16_t>(gatherBits(i >> 2) << 6 | gatherBits(i >> 1) << 3 |
                                          gatherBits(i));
  }
  return table;
}

constexpr auto kVoxelTable = makeVoxelTable();

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
  for (std::uint32_t i = 0; i < cuboids.size(); ++i) {
    const CellBox& box = cuboids[i].box;
    const CellBox inside = intersect(box, kOctreeCells);
    if (inside != box) sorted.num_left_out += box.numVoxels() - inside.numVoxels();
    if (inside.isEmpty()) continue;
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
  DenseBrick dense;
  dense.brick = brick;
  for (const std::uint32_t* member = first; member != last; ++member) {
    Cuboid cuboid = cuboids[*member];
    if (kind == OctreeKind::kBinary) {
      cuboid.log_odds = cuboid.occupancy() == Occupancy::kOccupied ? 1.0F : -1.0F;
    }
    dense.fill(cuboid);
  }
  voxels.is_uniform = true;
  for (std::size_t i = 0; i < kBrickVoxels; ++i) {
    const std::size_t voxel = kVoxelTable[i];
    voxels.log_odds[i] = dense.log_odds[voxel];
    voxels.is_known[i] = (dense.known[voxel >> 6] >> (voxel & 63) & 1) != 0;
    voxels.is_uniform &= voxels.is_known[i] && voxels.log_odds[i] == voxels.log_odds[0];
  }
}

}  // namespace cuboid_mapping
