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
  alignas(64) float margins[kSize];  ///< acrossMargin() of the ends.
  /// On the axes across: where the beam crosses the last plane, as the places in Face, and the column of the end.
  ///@{
  alignas(64) float places[2][kSize];
  alignas(64) float last_columns[2][kSize];
  ///@}
  alignas(64) float origins[2][kSize];  ///< Those of the beams' faces.
  /// Columns where the beam enters its last slab.
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
    // Rounding may put a border at the origin on the wrong side of it.
    const auto to_border = [&](int axis, bool is_up) {
      return std::max((is_up ? 1.0 : -1.0) * origin.toBorder(axis, is_up), 0.0) * inverse_m;
    };
    face.first_depth = to_border(face.axis, !face.is_down);
    for (std::size_t j = 0; j < 2; ++j) {
      const int axis = face.across[j];
      face.column[j] = start_[axis] & 7;
      face.to_borders[j] = {-to_border(axis, false), to_border(axis, true)};
      face.origin[j] = face.column[j] - face.to_borders[j][0];
    }
  }
}

// Compiled for two sets of instructions, which give the same bits.
#define CUBOID_MAPPING_FOR_BOTH [[gnu::always_inline]] inline

/// As cutBeam().
CUBOID_MAPPING_FOR_BOTH void CloudFaces::cutEnds(Batch& batch) const {
  const Eigen::Vector3f origin = origin_.point();
  const auto range = static_cast<float>(max_range_m_);
  for (int i = 0; i < kSize; ++i) {
    const float x = batch.ends[0][i] - origin[0];
    const float y = batch.ends[1][i] - origin[1];
    const float z = batch.ends[2][i] - origin[2];
    const double length_m = std::sqrt(static_cast<double>(x * x + y * y + z * z));
    const bool is_cut = length_m > max_range_m_;
    const auto length = static_cast<float>(length_m);
    batch.ends[0][i] = is_cut ? origin[0] + x / length * range : batch.ends[0][i];
    batch.ends[1][i] = is_cut ? origin[1] + y / length * range : batch.ends[1][i];
    batch.ends[2][i] = is_cut ? origin[2] + z / length * range : batch.ends[2][i];
    batch.is_cut[i] = is_cut ? 1 : 0;
  }
}

/// Faces and slopes. Sure are beams with a length.
CUBOID_MAPPING_FOR_BOTH void CloudFaces::findFaces(Batch& batch) const {
  const Eigen::Vector3f origin = origin_.point();
  const auto inverse_m = static_cast<float>(origin_.grid().inverseResolution());
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
    const float depth = way * inverse_m;
    batch.margins[i] = acrossMargin(depth);
    // The square of a length is a float32. False also for what is not a number.
    const bool has_length = (way > 1e-18F) & (way < 1e18F) & (depth < kMaxBeamVoxels - 1);
    batch.is_sure[i] = has_length ? 1 : 0;
  }
}

/// Voxels of the ends. Not sure are beams that end near a border.
CUBOID_MAPPING_FOR_BOTH void CloudFaces::findEnds(Batch& batch) const {
  const double resolution_inverse_m = origin_.grid().inverseResolution();
  for (int axis = 0; axis < 3; ++axis) {
    const double anchor = origin_.anchor()[axis];
    const double base = base_[axis];
    for (int i = 0; i < kSize; ++i) {
      const double place =
          (anchor + static_cast<double>(batch.ends[axis][i])) * resolution_inverse_m;
      const double cell = std::floor(place);
      const double from_middle = std::abs(place - cell - 0.5);
      const bool is_sure = from_middle < static_cast<double>(0.5F - batch.margins[i]);
      batch.local_ends[axis][i] = static_cast<std::int32_t>(is_sure ? cell - base : 0.0);
      batch.is_sure[i] &= is_sure ? 1 : 0;
    }
  }
}

/// Planes that the beams cross, and where they cross the last.
CUBOID_MAPPING_FOR_BOTH void CloudFaces::findPlanes(Batch& batch) const {
  float starts[3];
  float tiles[3];
  float origins[3];
  float up_depths[3];
  float down_depths[3];
  for (int axis = 0; axis < 3; ++axis) {
    const std::size_t up = 2 * static_cast<std::size_t>(axis);
    starts[axis] = static_cast<float>(start_[axis]);
    tiles[axis] = static_cast<float>(start_[axis] & ~7);
    origins[axis] = static_cast<float>(faces_[axis == 0 ? 2U : 0U].origin[axis == 2 ? 1U : 0U]);
    up_depths[axis] = static_cast<float>(faces_[up].first_depth);
    down_depths[axis] = static_cast<float>(faces_[up + 1].first_depth);
  }
  for (int i = 0; i < kSize; ++i) {
    const std::int32_t face = batch.faces[i];
    const bool is_z = face >= 4;
    const bool is_y = (face & 2) != 0;
    const bool is_down = (face & 1) != 0;
    const auto x = static_cast<float>(batch.local_ends[0][i]);
    const auto y = static_cast<float>(batch.local_ends[1][i]);
    const auto z = static_cast<float>(batch.local_ends[2][i]);
    const float num_planes =
        std::abs(is_z ? z - starts[2] : (is_y ? y - starts[1] : x - starts[0]));
    const float up_depth = is_z ? up_depths[2] : (is_y ? up_depths[1] : up_depths[0]);
    const float down_depth = is_z ? down_depths[2] : (is_y ? down_depths[1] : down_depths[0]);
    const float first_depth = is_down ? down_depth : up_depth;
    const float depth = num_planes > 0.0F ? first_depth + (num_planes - 1.0F) : 0.0F;
    const bool is_x_across = is_y | is_z;
    const float origin_0 = is_x_across ? origins[0] : origins[1];
    const float origin_1 = is_z ? origins[1] : origins[2];
    batch.num_planes[i] = static_cast<std::int32_t>(num_planes);
    batch.origins[0][i] = origin_0;
    batch.origins[1][i] = origin_1;
    batch.places[0][i] = origin_0 + batch.slopes[0][i] * depth;
    batch.places[1][i] = origin_1 + batch.slopes[1][i] * depth;
    batch.last_columns[0][i] = is_x_across ? x - tiles[0] : y - tiles[1];
    batch.last_columns[1][i] = is_z ? y - tiles[1] : z - tiles[2];
  }
}

/// The way through the last slab. Not sure are beams that enter it near a border, or cross two borders in it
/// at nearly the same place.
CUBOID_MAPPING_FOR_BOTH void CloudFaces::findLastSlabs(Batch& batch) {
  for (int i = 0; i < kSize; ++i) {
    const float margin = batch.margins[i];
    const float slope_0 = batch.slopes[0][i];
    const float slope_1 = batch.slopes[1][i];
    const float last_0 = batch.last_columns[0][i];
    const float last_1 = batch.last_columns[1][i];
    const float entry_0 = std::floor(batch.places[0][i]);
    const float entry_1 = std::floor(batch.places[1][i]);
    const bool is_inside = (std::abs(batch.places[0][i] - entry_0 - 0.5F) < 0.5F - margin) &
                           (std::abs(batch.places[1][i] - entry_1 - 0.5F) < 0.5F - margin);
    const float steps_0 = std::abs(last_0 - entry_0);
    const float steps_1 = std::abs(last_1 - entry_1);
    const float border_0 = (last_0 > entry_0 ? last_0 : entry_0) - batch.origins[0][i];
    const float border_1 = (last_1 > entry_1 ? last_1 : entry_1) - batch.origins[1][i];
    // Positive if the border on the first axis comes first.
    const float lead = std::abs(border_1 * slope_0) - std::abs(border_0 * slope_1);
    const bool has_two = (steps_0 > 0.0F) & (steps_1 > 0.0F);
    const bool is_decided =
        !has_two | (std::abs(lead) > margin * (std::abs(slope_0) + std::abs(slope_1)));
    batch.is_sure[i] &= (is_inside & (steps_0 <= 1.0F) & (steps_1 <= 1.0F) & is_decided) ? 1 : 0;
    batch.entries[0][i] = static_cast<std::int32_t>(is_inside ? entry_0 : 0.0F);
    batch.entries[1][i] = static_cast<std::int32_t>(is_inside ? entry_1 : 0.0F);
    batch.second_borders[i] = has_two ? (lead > 0.0F ? 1 : 0) : -1;
  }
}

CUBOID_MAPPING_FOR_BOTH void CloudFaces::setUpBeams(Batch& batch) const {
  if (std::isfinite(max_range_m_)) cutEnds(batch);
  findFaces(batch);
  findEnds(batch);
  findPlanes(batch);
  findLastSlabs(batch);
}

#undef CUBOID_MAPPING_FOR_BOTH

void CloudFaces::setUp(Batch& batch) const { setUpBeams(batch); }

#ifdef __x86_64__
[[gnu::target("avx2")]]
#endif
void CloudFaces::setUpWide(Batch& batch) const {
  setUpBeams(batch);
}

std::uint32_t CloudFaces::add(const Eigen::Vector3f* ends, int count, std::uint32_t wanted,
                              bool are_returns, std::size_t first_index, Parts& parts,
                              BeamMarks& marks) const {
  Batch batch;
  for (int i = 0; i < kSize; ++i) {
    const Eigen::Vector3f& end = ends[std::min(i, count - 1)];
    for (int axis = 0; axis < 3; ++axis) batch.ends[axis][i] = end[axis];
    batch.is_cut[i] = 0;
  }
  hasLanes() ? setUpWide(batch) : setUp(batch);
  std::uint32_t left = 0;
  BrickKey last_key = ~BrickKey{0};
  BrickMarks* last_marks = nullptr;
  const auto marks_of = [&](const Cell& voxel) -> BrickMarks& {
    const BrickKey key = toBrickKey(voxel);
    if (key != last_key) last_marks = &marks.findOrAdd(key);
    last_key = key;
    return *last_marks;
  };
  for (int i = 0; i < count; ++i) {
    if (batch.is_sure[i] == 0 || (wanted >> i & 1) == 0) {
      left |= 1U << i;
      continue;
    }
    const Cell end{batch.local_ends[0][i], batch.local_ends[1][i], batch.local_ends[2][i]};
    BrickMarks& end_marks = marks_of(end);
    const bool is_hit = are_returns && batch.is_cut[i] == 0;
    (is_hit ? end_marks.hits : end_marks.misses[0]).set(voxelIndex(end));
    const auto face = static_cast<std::size_t>(batch.faces[i]);
    if (batch.second_borders[i] >= 0) {
      const auto second = static_cast<std::size_t>(batch.second_borders[i]);
      const int axis = faces_[face].across[second];
      Cell between = end;
      between[axis] = (start_[axis] & ~7) + batch.entries[second][i];
      marks_of(between).misses[0].set(voxelIndex(between));
    }
    if (batch.num_planes[i] > 0) {
      // Filled in place: a copy would wait for the store of its parts.
      FaceBeam& beam = parts[face].emplace_back();
      beam.slopes[0] = batch.slopes[0][i];
      beam.slopes[1] = batch.slopes[1][i];
      beam.num_planes = static_cast<std::uint32_t>(batch.num_planes[i]);
      beam.end = static_cast<std::uint32_t>(first_index + static_cast<std::size_t>(i));
    } else if (end != start_) {
      marks_of(start_).misses[0].set(voxelIndex(start_));
    }
  }
  return left;
}

}  // namespace cuboid_mapping
