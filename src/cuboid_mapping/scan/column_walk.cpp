// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/scan/column_walk.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace cuboid_mapping {
namespace {

/// Nodes across a tile, and at most two more, are bits of a word.
constexpr double kNodesOfTile = 60.0;
/// Keeps quotients finite where the origin lies on plane 0.
constexpr double kLeastDepth = 1e-13;

/// The bits from one to another, as far as a word has them.
std::uint64_t bitsOf(int first, int last) {
  first = std::max(first, 0);
  last = std::min(last, 63);
  return first > last ? 0 : ~std::uint64_t{0} << first & ~std::uint64_t{0} >> (63 - last);
}

/// Whether beams can go this way in a tile: away from the origin, which is in tile 0.
bool isAway(int tile, int step) { return tile == 0 || (tile > 0) == (step > 0); }

}  // namespace

void ColumnWalk::mark(int first, int last) {
  PlaneColumns entered;
  PlaneColumns left;
  findColumns(first - 1, entered);
  for (int slab = first; slab < last; ++slab) {
    findColumns(slab, left);
    markSlab(slab, entered, left);
    markCorners(slab, entered, left);
    std::swap(entered, left);
  }
  left.reset({0, 0}, {-1, -1});
  markSlab(last, entered, left);
}

void ColumnWalk::findColumns(int plane, PlaneColumns& crossed) {
  if (plane < 0) {  // All beams are at the origin.
    crossed.reset({0, 0}, {0, 0});
    const int x = start_[face_.across[0]] & 7;
    const int y = start_[face_.across[1]] & 7;
    crossed.at(0, 0) = std::uint64_t{1} << (8 * y + x);
    return;
  }
  const double depth = std::max(face_.depthOf(plane), kLeastDepth);
  std::array<int, 2> first{};
  std::array<int, 2> last{};
  for (std::size_t i = 0; i < 2; ++i) {
    const auto columns = beams_.columnsAt(depth, i);
    first[i] = columns[0] >> 3;
    last[i] = columns[1] >> 3;
  }
  crossed.reset(first, last);
  const std::vector<Span> columns = spansAt(depth, first[0], crossed.size()[0], 0);
  const std::vector<Span> rows = spansAt(depth, first[1], crossed.size()[1], 1);
  const int level = beams_.levelOf(8.0 / depth, kNodesOfTile);
  for (int y = first[1]; y <= last[1]; ++y) {
    for (int x = first[0]; x <= last[0]; ++x) {
      crossed.at(x, y) =
          findInTile(plane, level, &columns[8 * static_cast<std::size_t>(x - first[0])],
                     &rows[8 * static_cast<std::size_t>(y - first[1])], {x, y});
    }
  }
}

std::vector<ColumnWalk::Span> ColumnWalk::spansAt(double depth, int first_tile, int num_tiles,
                                                  std::size_t across) const {
  const double margin = walkMargin(depth);
  std::vector<Span> spans(static_cast<std::size_t>(8 * num_tiles));
  int column = 8 * first_tile;
  for (Span& span : spans) {
    const double low = face_.toBorder(across, column);
    const double high = face_.toBorder(across, ++column);
    span.first = beams_.firstBin((low - margin) / depth, across);
    span.last = beams_.lastBin((high + margin) / depth, across);
    span.first_whole = beams_.firstWholeBin((low + margin) / depth, across);
    span.last_whole = beams_.lastWholeBin((high - margin) / depth, across);
  }
  return spans;
}

std::uint64_t ColumnWalk::findInTile(int plane, int level, const Span* columns, const Span* rows,
                                     const std::array<int, 2>& tile) {
  const int coarse = std::min(level + 4, beams_.numLevels() - 1);
  const FaceBeams::Bins all{{columns[0].first >> coarse, rows[0].first >> coarse},
                            {columns[7].last >> coarse, rows[7].last >> coarse}};
  if (!beams_.anyReaches(coarse, all, plane)) return 0;
  TileNodes nodes{level, columns[0].first >> level, rows[0].first >> level, {}};
  const int first_x = nodes.x;
  const int first_y = nodes.y;
  const int last_y = std::min(rows[7].last >> level, first_y + 63);
  auto& reached = nodes.reached;
  for (int y = first_y; y <= last_y; ++y) {
    reached[static_cast<std::size_t>(y - first_y)] =
        beams_.nodesThatReach(level, first_x, y, plane);
  }
  std::uint64_t some[8];
  std::uint64_t whole[8];
  const int edge = (1 << level) - 1;
  for (int i = 0; i < 8; ++i) {
    some[i] = bitsOf((columns[i].first >> level) - first_x, (columns[i].last >> level) - first_x);
    whole[i] = bitsOf(((columns[i].first_whole + edge) >> level) - first_x,
                      ((columns[i].last_whole + 1) >> level) - 1 - first_x);
  }
  std::uint64_t crossed = 0;
  for (int y = 0; y < 8; ++y) {
    std::uint64_t reached_some = 0;
    std::uint64_t reached_whole = 0;
    const int first_whole = ((rows[y].first_whole + edge) >> level);
    const int last_whole = ((rows[y].last_whole + 1) >> level) - 1;
    for (int i = rows[y].first >> level; i <= std::min(rows[y].last >> level, last_y); ++i) {
      reached_some |= reached[static_cast<std::size_t>(i - first_y)];
      if (i >= first_whole && i <= last_whole)
        reached_whole |= reached[static_cast<std::size_t>(i - first_y)];
    }
    if (reached_some == 0) continue;
    std::uint64_t doubtful = 0;
    for (int x = 0; x < 8; ++x) {
      const std::uint64_t is_crossed = (reached_whole & whole[x]) != 0 ? 1 : 0;
      const std::uint64_t is_reached = (reached_some & some[x]) != 0 ? 1 : 0;
      crossed |= is_crossed << (8 * y + x);
      doubtful |= (is_reached & ~is_crossed) << x;
    }
    for (; doubtful != 0; doubtful &= doubtful - 1) {
      const int x = __builtin_ctzll(doubtful);
      if (isCrossed(plane, nodes, columns[x], rows[y], {8 * tile[0] + x, 8 * tile[1] + y})) {
        crossed |= std::uint64_t{1} << (8 * y + x);
      }
    }
  }
  return crossed;
}

bool ColumnWalk::isCrossed(int plane, const TileNodes& nodes, const Span& column_span,
                           const Span& row_span, const std::array<int, 2>& column) {
  const double depth = face_.depthOf(plane);
  const double margin = walkMargin(depth);
  const double low[] = {face_.toBorder(0, column[0]), face_.toBorder(1, column[1])};
  const double high[] = {face_.toBorder(0, column[0] + 1), face_.toBorder(1, column[1] + 1)};
  unsure_.clear();
  auto is_in_column = [&](const FaceBeam& beam) {
    bool is_inside = true;
    for (std::size_t i = 0; i < 2; ++i) {
      const double place = beam.slopes[i] * depth;
      if (place < low[i] - margin || place > high[i] + margin) return false;
      is_inside &= place >= low[i] + margin && place <= high[i] - margin;
    }
    if (!is_inside) unsure_.push_back(beam.end);
    return is_inside;
  };
  const FaceBeams::Bins some{{column_span.first, row_span.first},
                             {column_span.last, row_span.last}};
  const FaceBeams::Bins whole{{column_span.first_whole, row_span.first_whole},
                              {column_span.last_whole, row_span.last_whole}};
  const int level = nodes.level;
  const std::uint64_t columns_of =
      bitsOf((column_span.first >> level) - nodes.x, (column_span.last >> level) - nodes.x);
  const int last_y = std::min((row_span.last >> level) - nodes.y, 63);
  for (int y = (row_span.first >> level) - nodes.y; y <= last_y; ++y) {
    for (std::uint64_t bits = nodes.reached[static_cast<std::size_t>(y)] & columns_of; bits != 0;
         bits &= bits - 1) {
      const int x = nodes.x + __builtin_ctzll(bits);
      if (beams_.anyBeamOf(level, x, nodes.y + y, some, whole, plane, is_in_column)) return true;
    }
  }
  for (const std::uint32_t end : unsure_) walk_beam_(end, plane + 1, marks_);
  return false;
}

BrickMask& ColumnWalk::missesAt(int slab, int tile_x, int tile_y) {
  Cell brick = start_;
  brick[face_.axis] = alongAt(slab);
  brick[face_.across[0]] = ((start_[face_.across[0]] >> 3) + tile_x) * 8;
  brick[face_.across[1]] = ((start_[face_.across[1]] >> 3) + tile_y) * 8;
  return marks_.findOrAdd(toBrickKey(brick)).misses[static_cast<std::size_t>(2 - face_.axis)];
}

void ColumnWalk::markSlab(int slab, const PlaneColumns& entered, const PlaneColumns& left) {
  const auto word = static_cast<std::size_t>(alongAt(slab) & 7);
  for (const PlaneColumns* columns : {&entered, &left}) {
    const auto& first = columns->first();
    for (int y = first[1]; y < first[1] + columns->size()[1]; ++y) {
      for (int x = first[0]; x < first[0] + columns->size()[0]; ++x) {
        const std::uint64_t marked = columns->of(x, y);
        if (marked != 0) missesAt(slab, x, y)[word] |= marked;
      }
    }
  }
}

void ColumnWalk::markCorners(int plane, const PlaneColumns& entered, const PlaneColumns& left) {
  const auto left_at = [&](int x, int y) { return left.of(x, y); };
  const auto marked_at = [&](int x, int y) { return entered.of(x, y) | left.of(x, y); };
  const auto& first = entered.first();
  for (int y = first[1]; y < first[1] + entered.size()[1]; ++y) {
    for (int x = first[0]; x < first[0] + entered.size()[0]; ++x) {
      const std::uint64_t from = entered.of(x, y);
      if (from == 0) continue;
      for (const int up : {-1, 1}) {
        for (const int right : {-1, 1}) {
          if (!isAway(x, right) || !isAway(y, up)) continue;
          const std::uint64_t crosses = from & neighbours(left_at, x, y, right, up);
          const std::uint64_t has_right = neighbours(marked_at, x, y, right, 0);
          const std::uint64_t has_up = neighbours(marked_at, x, y, 0, up);
          for (std::uint64_t bits = crosses & ~(has_right & has_up); bits != 0; bits &= bits - 1) {
            const int bit = __builtin_ctzll(bits);
            markCorner({plane, {8 * x + (bit & 7), 8 * y + (bit >> 3)}, {right, up}},
                       (has_right >> bit & 1) == 0, (has_up >> bit & 1) == 0);
          }
        }
      }
    }
  }
}

void ColumnWalk::markCorner(const Corner& corner, bool needs_right, bool needs_up) {
  const double near = std::max(face_.depthOf(corner.plane - 1), kLeastDepth);
  const double far = std::max(face_.depthOf(corner.plane), kLeastDepth);
  const double near_margin = walkMargin(near);
  const double margin = walkMargin(far);
  FaceBeams::Bins bins{};
  double borders[2];
  for (std::size_t i = 0; i < 2; ++i) {
    borders[i] = face_.toBorder(i, corner.column[i] + (corner.step[i] > 0 ? 1 : 0));
    if (borders[i] * corner.step[i] < -margin) return;
    const double at_far = borders[i] / far;
    // Any slope that way crosses it behind the origin.
    const double at_near = corner.plane == 0 ? 2.0 * corner.step[i] : borders[i] / near;
    const double far_spread = margin / far;
    const double near_spread = near_margin / near;
    bins.first[i] = beams_.firstBin(std::min(at_near - near_spread, at_far - far_spread), i);
    bins.last[i] = beams_.lastBin(std::max(at_near + near_spread, at_far + far_spread), i);
  }
  unsure_.clear();
  const auto crosses = [&](const FaceBeam& beam) {
    bool is_unsure = false;
    for (std::size_t i = 0; i < 2; ++i) {
      // Steps past the border at both planes: it crosses it between them. All beams begin before it.
      const double before = (beam.slopes[i] * near - borders[i]) * corner.step[i];
      const double behind = (beam.slopes[i] * far - borders[i]) * corner.step[i];
      if ((before > near_margin && corner.plane > 0) || behind < -margin) return false;
      is_unsure |= (before > -near_margin && corner.plane > 0) || behind < margin;
    }
    const double right_way = std::abs(borders[0] * beam.slopes[1]);
    const double up_way = std::abs(borders[1] * beam.slopes[0]);
    const double lead = up_way - right_way;  // Positive if the beam crosses to the right first.
    is_unsure |= std::abs(lead) <= walkMargin(right_way + up_way);
    if (is_unsure) {
      unsure_.push_back(beam.end);
    } else if (lead > 0.0 && needs_right) {
      markVoxel(corner.plane, corner.column[0] + corner.step[0], corner.column[1]);
      needs_right = false;
    } else if (lead < 0.0 && needs_up) {
      markVoxel(corner.plane, corner.column[0], corner.column[1] + corner.step[1]);
      needs_up = false;
    }
    return !needs_right && !needs_up;
  };
  const FaceBeams::Bins none{{1, 1}, {0, 0}};
  if (beams_.anyBeam(bins, none, corner.plane, crosses)) return;
  for (const std::uint32_t end : unsure_) walk_beam_(end, corner.plane, marks_);
}

}  // namespace cuboid_mapping
