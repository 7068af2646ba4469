// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/query/near_places.h"

#include "cuboid_mapping/geometry/box_faces.h"

#include <algorithm>
#include <cstdlib>

namespace cuboid_mapping {

NearPlaces::NearPlaces(FitField& field, const Eigen::Vector3d& point, const Eigen::Vector3d& size,
                       const CellBox& allowed)
    : field_(field),
      point_(point),
      half_(0.5 * size),
      span_(toVector(field.size())),
      allowed_(allowed) {}

std::optional<NearPlace> NearPlaces::findNearest(double max_distance) {
  search(max_distance, Wanted::kNearest);
  if (found_.empty() || field_.budget().isSpent()) return std::nullopt;
  return found_.back();
}

std::vector<NearPlace> NearPlaces::findAll(double max_distance) {
  search(max_distance, Wanted::kAll);
  std::stable_sort(found_.begin(), found_.end(),
                   [](const NearPlace& a, const NearPlace& b) { return a.squared < b.squared; });
  return std::move(found_);
}

double NearPlaces::farthest() const {
  return (point_ - toVector(allowed_.min))
      .cwiseAbs()
      .cwiseMax((point_ - toVector(allowed_.max) - span_).cwiseAbs())
      .norm();
}

void NearPlaces::search(double max_distance, Wanted wanted) {
  found_.clear();
  max_squared_ = std::pow(std::min(max_distance, farthest()), 2.0);
  if (allowed_.isEmpty()) return;
  const Cell middle = brickOf(floorOf(point_ - half_));
  const Cell away = brickOf(clampTo(allowed_, middle)) - middle;
  const std::int32_t first = std::max({std::abs(away.x), std::abs(away.y), std::abs(away.z)});
  for (std::int32_t ring = first / kBrickEdge; isNear(ring) && !field_.budget().isSpent(); ++ring) {
    searchRing(middle, ring * kBrickEdge, wanted);
  }
}

/// Whether a brick at this distance, in bricks, may hold a better place.
bool NearPlaces::isNear(std::int32_t ring) const {
  const double distance = kBrickEdge * (ring - 1.0) - 1.0;  // Edges are rounded up by less than 1.
  return distance <= 0.0 || distance * distance <= max_squared_;
}

/// The bricks of a ring that have allowed places.
void NearPlaces::searchRing(const Cell& middle, std::int32_t radius, Wanted wanted) {
  const CellBox ring{middle - Cell{radius, radius, radius}, middle + Cell{radius, radius, radius}};
  const CellBox part =
      intersect({ring.min, ring.max + Cell{1, 1, 1}}, {brickOf(allowed_.min), allowed_.max});
  for (std::int32_t z = part.min.z; z < part.max.z; z += kBrickEdge) {
    for (std::int32_t y = part.min.y; y < part.max.y; y += kBrickEdge) {
      const bool is_side = z == ring.min.z || z == ring.max.z || y == ring.min.y || y == ring.max.y;
      const std::int32_t step = is_side || radius == 0 ? kBrickEdge : 2 * radius;
      for (std::int32_t x = is_side ? part.min.x : ring.min.x; x < part.max.x; x += step) {
        if (x < part.min.x) continue;
        if (!field_.budget().spendAndUnlock()) return;
        searchBrick({x, y, z}, wanted);
      }
    }
  }
}

/// Also as far as the box is smaller than whole voxels.
NearPlace NearPlaces::nearestIn(const CellBox& places) const {
  const Eigen::Vector3d lower = toVector(places.min) + half_;
  const Eigen::Vector3d upper =
      (toVector(places.max) - Eigen::Vector3d::Ones() + span_ - half_).cwiseMax(lower);
  const Eigen::Vector3d center = point_.cwiseMax(lower).cwiseMin(upper);
  return {center, (center - point_).squaredNorm()};
}

Cell NearPlaces::placeAt(const Eigen::Vector3d& center, const CellBox& places) const {
  return clampTo(places, floorOf(center - half_));
}

void NearPlaces::searchBrick(const Cell& brick, Wanted wanted) {
  constexpr std::int32_t kLast = kBrickEdge + 1;  // One more: between this brick and the next.
  if (nearestIn({brick, brick + Cell{kLast, kLast, kLast}}).squared > max_squared_) return;
  const CellBox part = intersect(brickBox(brick), allowed_);
  if (part.isEmpty()) return;
  const BrickMask places = field_.inBrick(brick) & BrickMask::ofBox(part);
  forEachCell(brick, places, [&](const Cell& place) { findAt(place, wanted); });
}

void NearPlaces::keep(const NearPlace& place, Wanted wanted) {
  if (wanted == Wanted::kNearest) {
    found_.clear();
    max_squared_ = place.squared;
  }
  found_.push_back(place);
}

/// The positions at a place, and on the ways from it to its neighbours towards the point.
void NearPlaces::findAt(const Cell& place, Wanted wanted) {
  if (nearestIn({place, place + Cell{2, 2, 2}}).squared > max_squared_) return;
  int towards = 0;  // Bit per axis on which the point lies beyond the place.
  for (int axis = 0; axis < 3; ++axis) {
    towards |= point_[axis] > place[axis] + span_[axis] - half_[axis] ? 1 << axis : 0;
  }
  for (int axes = 0; axes < 8; ++axes) {
    if ((axes & ~towards) != 0) continue;
    const Cell end = place + Cell{1 + (axes & 1), 1 + (axes >> 1 & 1), 1 + (axes >> 2)};
    const NearPlace found = nearestIn({place, end});
    const bool is_better = found_.empty() || wanted == Wanted::kAll || found.squared < max_squared_;
    if (found.squared > max_squared_ || !is_better) continue;
    if (fitsBetween({place, end})) keep(found, wanted);
  }
}

bool NearPlaces::fitsBetween(const CellBox& places) {
  if (!allowed_.contains(places)) return false;
  for (std::int32_t z = places.min.z; z < places.max.z; ++z) {
    for (std::int32_t y = places.min.y; y < places.max.y; ++y) {
      for (std::int32_t x = places.min.x; x < places.max.x; ++x) {
        if (!field_.fits({x, y, z})) return false;
      }
    }
  }
  return true;
}

}  // namespace cuboid_mapping
