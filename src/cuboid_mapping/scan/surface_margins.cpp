// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/scan/surface_margins.h"

#include "cuboid_mapping/parallel/parallel_for.h"

#include <algorithm>
#include <cmath>

namespace cuboid_mapping {
namespace {

/// Directions are half a degree apart.
constexpr int kColumns = 720;
constexpr int kRows = 361;
constexpr float kPlacesPerRad = 360.0F / 3.14159265F;
/// Neighbours are at most 6 degrees apart.
constexpr int kMaxStep = 12;
/// In reaches: a longer gap between two neighbours is one of a surface only if the nearer one is grazed, too.
constexpr float kMaxGap = 5.0F;
/// In reaches: shorter parts are noise.
constexpr float kMinMargin = 2.0F;

/// Index of a place in the grid.
std::size_t indexOf(int row, int column) {
  return static_cast<std::size_t>(row) * std::size_t{kColumns} + static_cast<std::size_t>(column);
}

}  // namespace

/// Whether the surface between two neighbours is grazed, the second being farther from the beam: it rises by less than 1
/// in 2. A slab so thin that the beam below it passes it counts, too; beside a beam it would be a post.
bool SurfaceMargins::isGrazed(const SeenEnd& seen, const SeenEnd& next, const Way& way) {
  if (next.across_m < seen.across_m) return false;
  const bool is_slab = way.rows != 0 && next.along_m > seen.along_m;
  return is_slab || seen.along_m - next.along_m >= 2.0F * (next.across_m - seen.across_m);
}

void SurfaceMargins::place(const Scan& scan) {
  const std::size_t num_points = scan.points.size();
  const std::size_t count = num_points + scan.open_ends.size();
  ends_.resize(count);
  places_.resize(count);
  grid_.assign(std::size_t{kColumns} * kRows, -1);
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector3f end =
        (i < num_points ? scan.points[i] : scan.open_ends[i - num_points]) - scan.origin;
    const float flat = std::hypot(end.x(), end.y());
    ends_[i] = end;
    places_[i] = {-1, -1};
    if (!end.allFinite() || end.isZero(0.0F)) continue;
    const auto column =
        static_cast<int>(std::lround((std::atan2(end.y(), end.x())) * kPlacesPerRad));
    const auto row = static_cast<int>(std::lround(std::atan2(end.z(), flat) * kPlacesPerRad));
    places_[i] = {static_cast<std::int16_t>((column + kColumns) % kColumns),
                  static_cast<std::int16_t>(row + kRows / 2)};
    grid_[indexOf(places_[i].row, places_[i].column)] = static_cast<std::int32_t>(i);
  }
}

/// The next end in a direction of the grid. @param step  Steps from the place, advanced. @return Null: none is near.
const Eigen::Vector3f* SurfaceMargins::findNear(const Place& place, const Way& way,
                                                int& step) const {
  for (++step; step <= kMaxStep; ++step) {
    const int row = place.row + way.rows * step;
    if (row < 0 || row >= kRows) break;
    const int column = (place.column + way.columns * step + kColumns) % kColumns;
    const std::int32_t index = grid_[indexOf(row, column)];
    if (index >= 0) return &ends_[static_cast<std::size_t>(index)];
  }
  return nullptr;
}

/// Where a beam comes within reach of the surface that its neighbours of one side hit.
float SurfaceMargins::beginOf(std::size_t beam, const Way& way) const {
  const Place place = places_[beam];
  const float length_m = ends_[beam].norm();
  const Eigen::Vector3f direction = ends_[beam] / length_m;
  const auto seen_from = [&](const Eigen::Vector3f& end) {
    const float along_m = end.dot(direction);
    return SeenEnd{along_m, (end - along_m * direction).norm()};
  };
  SeenEnd last{length_m, 0.0F};
  int step = 0;
  const Eigen::Vector3f* near = findNear(place, way, step);
  while (near != nullptr) {
    const SeenEnd seen = seen_from(*near);
    const Eigen::Vector3f* next = findNear(place, way, step);
    if (last.along_m - seen.along_m > kMaxGap * reach_m_ &&
        (next == nullptr || !isGrazed(seen, seen_from(*next), way))) {
      break;  // Something stands before the surface.
    }
    if (seen.across_m > reach_m_) {
      const float share = (reach_m_ - last.across_m) / (seen.across_m - last.across_m);
      return last.along_m + share * (seen.along_m - last.along_m);
    }
    last = seen;
    near = next;
  }
  return last.along_m;
}

float SurfaceMargins::marginOf(std::size_t beam) const {
  if (places_[beam].row < 0) return 0.0F;
  const float length_m = ends_[beam].norm();
  float begin_m = length_m;
  for (const Way& way : {Way{0, -1}, Way{0, 1}, Way{-1, 0}, Way{1, 0}}) {
    begin_m = std::min(begin_m, beginOf(beam, way));
  }
  const float margin_m = length_m - begin_m;
  return margin_m < kMinMargin * reach_m_ ? 0.0F : margin_m + reach_m_;
}

const std::vector<float>& SurfaceMargins::compute(const Scan& scan) {
  place(scan);
  margins_m_.resize(ends_.size());
  constexpr std::size_t kPart = 1024;
  const std::size_t num_parts = (ends_.size() + kPart - 1) / kPart;
  parallelFor(num_parts, threads_, [&](std::size_t part) {
    const std::size_t end = std::min(ends_.size(), (part + 1) * kPart);
    for (std::size_t i = part * kPart; i < end; ++i) margins_m_[i] = marginOf(i);
  });
  return margins_m_;
}

}  // namespace cuboid_mapping
