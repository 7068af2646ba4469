// SPDX-License-Identifier: BSD-3-Clause
// What a peer tells by all cells that it knows. for_each calls its argument, (const CellBox&, float log_odds),
// for each cell once.
#pragma once

#include "map_adapter.h"
#include "peers/agreement_counter.h"

namespace cuboid_mapping::bench {

/// Sets the numbers of cells.
template <typename ForEachT>
void countCells(const ForEachT& for_each, MapFigures& figures) {
  for_each([&figures](const CellBox& /*cell*/, float log_odds) {
    ++(classify(log_odds) == Occupancy::kOccupied ? figures.occupied_cells : figures.free_cells);
  });
  figures.cells = figures.occupied_cells + figures.free_cells;
}

/// Visits the occupied cells. @return The sum of their least x.
template <typename ForEachT>
[[nodiscard]] double sumOccupied(const ForEachT& for_each) {
  double sum = 0.0;
  for_each([&sum](const CellBox& cell, float log_odds) {
    if (classify(log_odds) == Occupancy::kOccupied) sum += cell.min.x;
  });
  return sum;
}

template <typename ForEachT>
[[nodiscard]] Agreement agreementOf(const ForEachT& for_each, const CuboidMap& map) {
  AgreementCounter counter(map);
  for_each([&counter](const CellBox& cell, float log_odds) { counter.add(cell, log_odds); });
  return counter.result();
}

}  // namespace cuboid_mapping::bench
