// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/class_boxes.h"

#include "cuboid_mapping/fusion/mask_boxes.h"

#include <cassert>

namespace cuboid_mapping {
namespace {

constexpr std::int32_t kBlockEdge = kBrickEdge * kBrickEdge;

Cell blockOf(const Cell& cell) {
  return {cell.x & ~(kBlockEdge - 1), cell.y & ~(kBlockEdge - 1), cell.z & ~(kBlockEdge - 1)};
}

/// Divides one block after the other.
class BlockDivider {
 public:
  BlockDivider(const VoxelClasses& classes, const CellBox& region, Occupancy occupancy)
      : classes_(classes), region_(region), is_occupied_(occupancy == Occupancy::kOccupied) {}

  void divide(const Cell& block) {
    BrickMask uniform{};  // A bit for each brick of the block.
    const CellBox part =
        intersect(region_, {block, block + Cell{kBlockEdge, kBlockEdge, kBlockEdge}});
    (void)anyBrick(part, [&](const Cell& brick) {
      const BrickMask mask = maskOf(brick);
      if (isFull(mask)) {
        const Cell at{(brick.x - block.x) / kBrickEdge, (brick.y - block.y) / kBrickEdge,
                      (brick.z - block.z) / kBrickEdge};
        uniform[static_cast<std::size_t>(at.z)] |= voxelBit(at);
      } else {
        append(mask, brick, 1);
      }
      return false;  // On to the next.
    });
    append(uniform, block, kBrickEdge);
  }

  [[nodiscard]] std::vector<CellBox> takeBoxes() { return std::move(boxes_); }

 private:
  /// The voxels of the class in a brick that lie in the region.
  [[nodiscard]] BrickMask maskOf(const Cell& brick) const {
    VoxelClasses::Masks masks{};
    if (!classes_.find(brick, masks)) return {};
    BrickMask mask = toMask(intersect(region_, brickBox(brick)));
    for (std::size_t z = 0; z < kBrickEdge; ++z) {
      const std::uint64_t occupied = (*masks.occupied)[z];
      mask[z] &= (*masks.known)[z] & (is_occupied_ ? occupied : ~occupied);
    }
    return mask;
  }

  static bool isFull(const BrickMask& mask) {
    for (const std::uint64_t slice : mask) {
      if (slice != ~0ULL) return false;
    }
    return true;
  }

  void append(const BrickMask& mask, const Cell& corner, std::int32_t scale) {
    const auto place = [&](const Cell& at) {
      return corner + Cell{scale * at.x, scale * at.y, scale * at.z};
    };
    divided_.clear();
    divideIntoBoxes(mask, divided_);
    for (const CellBox& box : divided_) boxes_.push_back({place(box.min), place(box.max)});
  }

  const VoxelClasses& classes_;
  CellBox region_;
  bool is_occupied_;
  std::vector<CellBox> divided_;
  std::vector<CellBox> boxes_;
};

}  // namespace

std::vector<CellBox> findClassBoxes(const CuboidMap& map, const CellBox& region,
                                    Occupancy occupancy) {
  assert(occupancy != Occupancy::kUnknown);
  const auto bounds = map.tree().bounds();
  if (!bounds) return {};
  const CellBox part = intersect(region, *bounds);
  if (part.isEmpty()) return {};
  BlockDivider divider(map.classes(), part, occupancy);
  const Cell first = blockOf(part.min);
  for (std::int32_t z = first.z; z < part.max.z; z += kBlockEdge) {
    for (std::int32_t y = first.y; y < part.max.y; y += kBlockEdge) {
      for (std::int32_t x = first.x; x < part.max.x; x += kBlockEdge) divider.divide({x, y, z});
    }
  }
  return divider.takeBoxes();
}

}  // namespace cuboid_mapping
