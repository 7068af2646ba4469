// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/scan/cloud_faces.h"

#include "cuboid_mapping/geometry/brick_mask.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace cuboid_mapping {
namespace {

constexpr int kSize = RayBatch::kSize;

}  // namespace

/// Beams in arrays; loops over them are written for compilers that make vectors of them.
struct CloudFaces::Batch {
  alignas(64) float ends[3][kSize];
  alignas(64) std::int32_t is_cut[kSize];
  alignas(64) std::int32_t is_sure[kSize];
  alignas(64) std::int32_t faces[kSize];
  alignas(64) std::int32_t local_ends[3][kSize];
  alignas(64) std::int32_t num_planes[kSize];
  alignas(64) float slopes[2][kSize];
  /// Where the beam enters its last slab, as the places in Face.
  alignas(64) std::int32_t entries[2][kSize];
  /// 0 or 1: the border across that it crosses second in its last slab; -1 if it crosses at most one.
  alignas(64) std::int32_t second_borders[kSize];
};

CloudFaces::CloudFaces(const RayOrigin& origin, const Cell& base, double max_range_m)
    : origin_(origin), base_(base), max_range_m_(max_range_m), start_(*origin.cell() - base) {
  const double inverse_m = origin.grid().inverseResolution();
  for (std::size_t i = 0; i < kNumFaces; ++i) {
    Face& face = faces_[i];
    face.axis = static_cast<int>(i / 2);
    face.is_down = i % 2 != 0;
    face.across = {face.axis == 0 ? 1 : 0, face.axis == 2 ? 1 : 2};
    face.first_depth = std::abs(origin.toBorder(face.axis, !face.is_down)) * inverse_m;
    for (std::size_t j = 0; j < 2; ++j) {
      const int axis = face.across[j];
      face.origin[j] = (start_[axis] & 7) - origin.toBorder(axis, false) * inverse_m;
    }
  }
}

/// Compiled for two sets of instructions, which give the same bits.
[[gnu::always_inline]] inline void CloudFaces::setUpBeams(Batch& batch) const {
  const Eigen::Vector3f origin = origin_.point();
  const double resolution_inverse_m = origin_.grid().inverseResolution();
  if (std::isfinite(max_range_m_)) {
    for (int i = 0; i < kSize; ++i) {
      const float x = batch.ends[0][i] - origin[0];
      const float y = batch.ends[1][i] - origin[1];
      const float z = batch.ends[2][i] - origin[2];
      const double length_m = std::sqrt(static_cast<double>(x * x + y * y + z * z));
      const bool is_cut = length_m > max_range_m_;
      const auto length = static_cast<float>(length_m);
      const auto range = static_cast<float>(max_range_m_);
      batch.ends[0][i] = is_cut ? origin[0] + x / length * range : batch.ends[0][i];
      batch.ends[1][i] = is_cut ? origin[1] + y / length * range : batch.ends[1][i];
      batch.ends[2][i] = is_cut ? origin[2] + z / length * range : batch.ends[2][i];
      batch.is_cut[i] = is_cut ? 1 : 0;
    }
  }

  alignas(64) float margins[kSize];
  alignas(64) double limits[kSize];  // Of distances from the middle of a voxel.
  for (int i = 0; i < kSize; ++i) {
    const float x = batch.ends[0][i] - origin[0];
    const float y = batch.ends[1][i] - origin[1];
    const float z = batch.ends[2][i] - origin[2];
    const bool is_y = std::abs(y) > std::abs(x);
    const float longer = is_y ? y : x;
    const bool is_z = std::abs(z) > std::abs(longer);
    const float along = is_z ? z : longer;
    const float way = std::abs(along);
    batch.faces[i] = (is_z ? 4 : (is_y ? 2 : 0)) + (along < 0.0F ? 1 : 0);
    batch.slopes[0][i] = ((is_y | is_z) ? x : y) / way;
    batch.slopes[1][i] = (is_z ? y : z) / way;
    const float depth = way * static_cast<float>(resolution_inverse_m);
    margins[i] = acrossMargin(depth);
    limits[i] = 0.5F - margins[i];
    // The square of a length is a float32. False also for what is not a number.
    const bool has_length = (way > 1e-18F) & (way < 1e18F) & (depth < kMaxBeamVoxels - 1);
    batch.is_sure[i] = has_length ? 1 : 0;
  }

  for (int axis = 0; axis < 3; ++axis) {
    const double anchor = origin_.anchor()[axis];
    const double base = base_[axis];
    for (int i = 0; i < kSize; ++i) {
      const double place =
          (anchor + static_cast<double>(batch.ends[axis][i])) * resolution_inverse_m;
      const double cell = std::floor(place);
      const double from_middle = std::abs(place - cell - 0.5);
      const bool is_sure = from_middle < limits[i];
      batch.local_ends[axis][i] = static_cast<std::int32_t>(is_sure ? cell - base : 0.0);
      batch.is_sure[i] &= is_sure ? 1 : 0;
    }
  }

  float starts[3];
  float tiles[3];
  float origins[3];
  float up_depths[3];
  float down_depths[3];
  for (int axis = 0; axis < 3; ++axis) {
    starts[axis] = static_cast<float>(start_[axis]);
    tiles[axis] = static_cast<float>(start_[axis] & ~7);
    origins[axis] = static_cast<float>(faces_[axis == 0 ? 2U : 0U].origin[axis == 2 ? 1U : 0U]);
    up_depths[axis] = static_cast<float>(faces_[2 * static_cast<std::size_t>(axis)].first_depth);
    down_depths[axis] =
        static_cast<float>(faces_[2 * static_cast<std::size_t>(axis) + 1].first_depth);
  }
  for (int i = 0; i < kSize; ++i) {
    const std::int32_t face = batch.faces[i];
    const bool is_z = face >= 4;
    const bool is_y = (face & 2) != 0;
    const bool is_down = (face & 1) != 0;
    const auto x = static_cast<float>(batch.local_ends[0][i]);
    const auto y = static_cast<float>(batch.local_ends[1][i]);
    const auto z = static_cast<float>(batch.local_ends[2][i]);
    const float along = is_z ? z - starts[2] : (is_y ? y - starts[1] : x - starts[0]);
    const float num_planes = std::abs(along);
    const float up_depth = is_z ? up_depths[2] : (is_y ? up_depths[1] : up_depths[0]);
    const float down_depth = is_z ? down_depths[2] : (is_y ? down_depths[1] : down_depths[0]);
    const float first_depth = is_down ? down_depth : up_depth;
    const float depth = num_planes > 0.0F ? first_depth + (num_planes - 1.0F) : 0.0F;
    const float margin = margins[i];
    const bool is_x_across = is_y | is_z;
    const float origin_0 = is_x_across ? origins[0] : origins[1];
    const float origin_1 = is_z ? origins[1] : origins[2];
    const float last_0 = is_x_across ? x - tiles[0] : y - tiles[1];
    const float last_1 = is_z ? y - tiles[1] : z - tiles[2];
    const float slope_0 = batch.slopes[0][i];
    const float slope_1 = batch.slopes[1][i];
    const float place_0 = origin_0 + slope_0 * depth;
    const float place_1 = origin_1 + slope_1 * depth;
    const float entry_0 = std::floor(place_0);
    const float entry_1 = std::floor(place_1);
    const bool is_inside = (std::abs(place_0 - entry_0 - 0.5F) < 0.5F - margin) &
                           (std::abs(place_1 - entry_1 - 0.5F) < 0.5F - margin);
    const float steps_0 = std::abs(last_0 - entry_0);
    const float steps_1 = std::abs(last_1 - entry_1);
    const float border_0 = (last_0 > entry_0 ? last_0 : entry_0) - origin_0;
    const float border_1 = (last_1 > entry_1 ? last_1 : entry_1) - origin_1;
    // Positive if the border on the first axis comes first.
    const float lead = std::abs(border_1 * slope_0) - std::abs(border_0 * slope_1);
    const bool has_two = (steps_0 > 0.0F) & (steps_1 > 0.0F);
    const bool is_decided =
        !has_two | (std::abs(lead) > margin * (std::abs(slope_0) + std::abs(slope_1)));
    batch.is_sure[i] &= (is_inside & (steps_0 <= 1.0F) & (steps_1 <= 1.0F) & is_decided) ? 1 : 0;
    batch.num_planes[i] = static_cast<std::int32_t>(num_planes);
    batch.entries[0][i] = static_cast<std::int32_t>(is_inside ? entry_0 : 0.0F);
    batch.entries[1][i] = static_cast<std::int32_t>(is_inside ? entry_1 : 0.0F);
    batch.second_borders[i] = has_two ? (lead > 0.0F ? 1 : 0) : -1;
  }
}

void CloudFaces::setUp(Batch& batch) const { setUpBeams(batch); }

#ifdef __x86_64__
[[gnu::target("avx2")]]
#endif
void CloudFaces::setUpWide(Batch& batch) const {
  setUpBeams(batch);
}

std::uint32_t CloudFaces::add(const Eigen::Vector3f* ends, int count, bool are_returns,
                              std::size_t first_index, Parts& parts, BeamMarks& marks) const {
  Batch batch;
  for (int i = 0; i < kSize; ++i) {
    const Eigen::Vector3f& end = ends[std::min(i, count - 1)];
    for (int axis = 0; axis < 3; ++axis) batch.ends[axis][i] = end[axis];
    batch.is_cut[i] = 0;
  }
  hasLanes() ? setUpWide(batch) : setUp(batch);
  std::uint32_t left = 0;
  Cell last_end;
  bool is_last_hit = false;
  bool has_last = false;
  std::vector<FaceBeam>* beams = nullptr;  // With room for all that are left.
  std::size_t num_beams = 0;
  for (int i = 0; i < count; ++i) {
    if (batch.is_sure[i] == 0) {
      left |= 1U << i;
      continue;
    }
    const Cell end{batch.local_ends[0][i], batch.local_ends[1][i], batch.local_ends[2][i]};
    const bool is_hit = are_returns && batch.is_cut[i] == 0;
    if (!has_last || end != last_end || is_hit != is_last_hit) {
      BrickMarks& end_marks = marks.findOrAdd(toBrickKey(end));
      (is_hit ? end_marks.hits : end_marks.misses[0]).set(voxelIndex(end));
      last_end = end;
      is_last_hit = is_hit;
      has_last = true;
    }
    const auto face = static_cast<std::size_t>(batch.faces[i]);
    if (batch.second_borders[i] >= 0) {
      const auto second = static_cast<std::size_t>(batch.second_borders[i]);
      const int axis = faces_[face].across[second];
      Cell between = end;
      between[axis] = (start_[axis] & ~7) + batch.entries[second][i];
      marks.findOrAdd(toBrickKey(between)).misses[0].set(voxelIndex(between));
    }
    if (batch.num_planes[i] > 0) {
      if (&parts[face] != beams) {
        if (beams != nullptr) beams->resize(num_beams);
        beams = &parts[face];
        num_beams = beams->size();
        beams->resize(num_beams + static_cast<std::size_t>(count - i));
      }
      (*beams)[num_beams++] = {
          {batch.slopes[0][i], batch.slopes[1][i]},
          static_cast<std::uint32_t>(batch.num_planes[i]),
          static_cast<std::uint32_t>(first_index + static_cast<std::size_t>(i))};
    } else if (end != start_) {
      marks.findOrAdd(toBrickKey(start_)).misses[0].set(voxelIndex(start_));
    }
  }
  if (beams != nullptr) beams->resize(num_beams);
  return left;
}

}  // namespace cuboid_mapping
