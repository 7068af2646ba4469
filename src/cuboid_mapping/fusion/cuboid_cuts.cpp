// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/fusion/cuboid_cuts.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace cuboid_mapping {
namespace {

/// Calls visit(const CellBox&) for each piece of a box without some of its cells.
template <typename VisitT>
void visitPieces(const CellBox& box, std::vector<Cell> cells, VisitT visit) {
  struct Part {
    CellBox box;
    std::vector<Cell> cells;
  };
  std::vector<Part> parts{{box, std::move(cells)}};
  while (!parts.empty()) {
    const Part part = std::move(parts.back());
    parts.pop_back();
    if (part.cells.empty()) {
      visit(part.box);
      continue;
    }
    for (const CellBox& piece : subtract(part.box, CellBox::ofCell(part.cells.front()))) {
      Part next{piece, {}};
      std::copy_if(part.cells.begin(), part.cells.end(), std::back_inserter(next.cells),
                   [&piece](const Cell& cell) { return piece.contains(cell); });
      parts.push_back(std::move(next));
    }
  }
}

}  // namespace

void CuboidCuts::add(const Cuboid& cuboid, const Cell& brick, const BrickMask& voxels) {
  Cut& cut = cuts_[cuboid.box.min];
  cut.cuboid = cuboid;
  forEachCell(brick, voxels, [&cut](const Cell& cell) { cut.cells.push_back(cell); });
}

void CuboidCuts::apply(GrowingBricks& bricks) {
  for (auto& entry : cuts_) {
    Cut& cut = entry.second;
    bricks.remove(cut.cuboid.box);
    visitPieces(cut.cuboid.box, std::move(cut.cells), [&](const CellBox& piece) {
      if (piece.numVoxels() > 1.0) bricks.add({piece, cut.cuboid.occupancy});
    });
  }
  cuts_.clear();
}

}  // namespace cuboid_mapping
