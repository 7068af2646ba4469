// SPDX-License-Identifier: BSD-3-Clause
// The part of ScanUpdater that takes dense beams by columns.
#include "cuboid_mapping/scan/brick_cursor.h"
#include "cuboid_mapping/scan/column_walk.h"
#include "cuboid_mapping/scan/scan_update.h"
#include "cuboid_mapping/scan/slab_walk.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace cuboid_mapping {
namespace {

/// Beams of one piece of work.
constexpr std::size_t kBeamsOfPart = 4096;
/// Slabs of one piece of work. Each piece finds the columns at one plane that another finds, too.
constexpr int kSlabsOfPiece = 8;
/// Clouds of fewer beams are nowhere dense enough for columns to pay.
constexpr std::size_t kMinDenseBeams = 4096;
/// One beam of so many is looked at: a prime, since clouds have rows of round numbers.
constexpr std::size_t kSampleStep = 37;
/// Fields of slopes on each axis of a face.
constexpr int kFields = 16;
constexpr double kFieldEdge = 2.0 / kFields;

/// Measured costs, in slabs that the walk takes one beam through.
constexpr double kWalkSetUp = 15.0;
constexpr double kSort = 13.0;    ///< Sorting a beam into its face.
constexpr double kColumn = 20.0;  ///< Finding and marking a column at a plane.

constexpr double kMinGain = 0.15;  ///< As a share of the walk's cost.

/// Consecutive slabs of a face.
struct Piece {
  std::size_t face;
  int first;
  int last;
};

struct Sample {
  int field;
  float depth;
};

/// Whether the origin lies on an edge of voxels without any rounding: the beams' first steps are ties there, which
/// ColumnWalk leaves to walkRay(). The walk of each is faster then.
bool isOnEdge(const RayOrigin& origin) {
  int num_borders = 0;
  for (int axis = 0; axis < 3; ++axis) {
    num_borders +=
        (origin.toBorder(axis, false) >= 0.0 || origin.toBorder(axis, true) <= 0.0) ? 1 : 0;
  }
  return num_borders > 1;
}

/// Whether ColumnWalk is expected to be clearly cheaper for a scan than the walk of each beam, from the density
/// of a part of the beams. Those that graze are walked anyway.
/// @param margins  Of the scan; null: none. @pre origin.cell().
bool areDense(const Scan& scan, const float* margins, const RayOrigin& origin, double max_range_m) {
  const std::size_t num_beams = scan.points.size() + scan.no_returns.size();
  const double inverse_m = origin.grid().inverseResolution();
  std::array<int, kNumFaces * kFields * kFields> counts{};
  std::vector<Sample> samples;
  samples.reserve(num_beams / kSampleStep + 1);
  double cost = 0.0;
  for (std::size_t i = 0; i < num_beams; i += kSampleStep) {
    const Eigen::Vector3f& end =
        i < scan.points.size() ? scan.points[i] : scan.no_returns[i - scan.points.size()];
    const Eigen::Vector3f way = end - origin.point();
    int axis = std::abs(way.y()) > std::abs(way.x()) ? 1 : 0;
    if (std::abs(way.z()) > std::abs(way[axis])) axis = 2;
    const float along = std::abs(way[axis]);
    if (!(along > 0.0F && std::isfinite(along))) continue;
    const double part = std::min(1.0, max_range_m / static_cast<double>(way.norm()));
    const auto depth = static_cast<float>(along * part * inverse_m);
    cost += kWalkSetUp + depth;
    const std::size_t num_before = i < scan.points.size() ? 0 : scan.open_ends.size();
    if (margins != nullptr && margins[num_before + i] > 0.0F) continue;
    int field = 2 * axis + (way[axis] < 0.0F ? 1 : 0);
    for (const int across : {axis == 0 ? 1 : 0, axis == 2 ? 1 : 2}) {
      field = kFields * field +
              std::min(static_cast<int>((way[across] / along + 1.0F) / kFieldEdge), kFields - 1);
    }
    ++counts[static_cast<std::size_t>(field)];
    samples.push_back({field, depth});
  }
  double gain = 0.0;
  for (const Sample& sample : samples) {
    const double per_slope = counts[static_cast<std::size_t>(sample.field)] *
                             static_cast<double>(kSampleStep) / (kFieldEdge * kFieldEdge);
    const double dense = std::sqrt(per_slope / kColumn);
    gain -= kSort;
    // The columns that a beam shares grow with the square of the depth. Beams that end where they are sparse
    // are set up a second time there, which takes what they saved.
    if (sample.depth < dense)
      gain += kWalkSetUp + sample.depth -
              sample.depth * sample.depth * sample.depth / (3.0 * dense * dense);
  }
  return gain > kMinGain * cost;
}

}  // namespace

bool ScanUpdater::usesColumns(const Scan& scan, const float* margins) const {
  if (column_use_ == ColumnUse::kNever || ranges_.end_margin_m > 0.0) return false;
  const RayOrigin origin(grid_, scan.anchor_map, scan.origin);
  if (!isWithinKeyRange(origin)) return false;
  if (column_use_ == ColumnUse::kAlways) return true;
  if (scan.points.size() + scan.no_returns.size() < kMinDenseBeams || isOnEdge(origin))
    return false;
  return areDense(scan, margins, origin, ranges_.max_range_m);
}

void ScanUpdater::addByColumns(const Scan& scan, const float* margins) {
  const BeamSource source{scan, RayOrigin(grid_, scan.anchor_map, scan.origin)};
  const CloudFaces faces(source.ray_origin, base_, ranges_.max_range_m);
  for (Share& share : shares_) {
    for (auto& part : share.faces) part.clear();
  }
  sortIntoFaces(source, beamsOf(scan, BeamKind::kReturn, margins), 0, faces);
  sortIntoFaces(source, beamsOf(scan, BeamKind::kNoReturn, margins), scan.points.size(), faces);
  parallelFor(kNumFaces, numThreads(), [&](std::size_t face) {
    std::vector<FaceBeam>& beams = shares_.front().faces[face];
    for (std::size_t i = 1; i < shares_.size(); ++i) {
      const std::vector<FaceBeam>& more = shares_[i].faces[face];
      beams.insert(beams.end(), more.begin(), more.end());
    }
    face_beams_[face].sort(faces[face], beams);
  });
  walkColumns(source, faces);
  walkBehindColumns(source);
}

/// Beams that graze, and those that CloudFaces leaves, are walked here.
void ScanUpdater::sortIntoFaces(const BeamSource& source, const Beams& beams,
                                std::size_t first_index, const CloudFaces& faces) {
  const std::size_t num_parts = (beams.count + kBeamsOfPart - 1) / kBeamsOfPart;
  forEachPart(num_parts, [&](std::size_t part, Share& share) {
    const std::size_t last = std::min((part + 1) * kBeamsOfPart, beams.count);
    std::vector<Eigen::Vector3f> ends;
    std::vector<float> margins;
    for (std::size_t i = part * kBeamsOfPart; i < last; i += RayBatch::kSize) {
      const Beams batch = beams.part(i, std::min<std::size_t>(i + RayBatch::kSize, last));
      const auto count = static_cast<int>(batch.count);
      std::uint32_t grazing = 0;
      for (std::size_t beam = 0; beam < batch.count; ++beam) {
        grazing |= std::uint32_t{batch.marginOf(beam) > 0.0F} << beam;
      }
      std::uint32_t left =
          faces.add(batch.ends, count, RayBatch::all(count) & ~grazing,
                    beams.kind == BeamKind::kReturn, first_index + i, share.faces, share.marks);
      share.num_points += static_cast<std::size_t>(count - __builtin_popcount(left));
      for (; left != 0; left &= left - 1) {
        const auto beam = static_cast<std::size_t>(__builtin_ctz(left));
        ends.push_back(batch.ends[beam]);
        margins.push_back(batch.marginOf(beam));
      }
    }
    addBeams(source, {ends.data(), margins.data(), ends.size(), beams.kind}, share);
  });
}

void ScanUpdater::walkColumns(const BeamSource& source, const CloudFaces& faces) {
  std::vector<Piece> pieces;
  for (std::size_t face = 0; face < kNumFaces; ++face) {
    const int num_slabs = face_beams_[face].numDensePlanes();
    num_column_slabs_ += static_cast<std::size_t>(num_slabs);
    for (int first = 0; first < num_slabs; first += kSlabsOfPiece) {
      pieces.push_back({face, first, std::min(first + kSlabsOfPiece, num_slabs)});
    }
  }
  forEachPart(pieces.size(), [&](std::size_t i, Share& share) {
    const Piece& piece = pieces[i];
    const auto walk_beam = [&](std::uint32_t index, int last_slab, BeamMarks& marks) {
      Ray ray;
      bool is_cut = false;
      if (!cutRay(source, source.endOf(index), ray, is_cut)) return;
      (void)walkRay(ray, SlabCursor(ray, base_, marks, faces[piece.face].axis, last_slab + 1));
    };
    ColumnWalk(face_beams_[piece.face], faces.start(), walk_beam, share.marks)
        .mark(piece.first, piece.last);
  });
}

/// Walks beams on from where they get sparse.
void ScanUpdater::walkBehindColumns(const BeamSource& source) {
  for (const FaceBeams& face : face_beams_) {
    if (face.maxPlanes() <= face.numDensePlanes()) continue;
    const int num_slabs = face.numDensePlanes();
    const std::vector<FaceBeam>& beams = face.beams();
    const std::size_t num_parts = (beams.size() + kBeamsOfPart - 1) / kBeamsOfPart;
    forEachPart(num_parts, [&](std::size_t part, Share& share) {
      const std::size_t last = std::min((part + 1) * kBeamsOfPart, beams.size());
      Eigen::Vector3f ends[RayBatch::kSize];
      int count = 0;
      for (std::size_t i = part * kBeamsOfPart; i < last; ++i) {
        if (static_cast<int>(beams[i].num_planes) > num_slabs)
          ends[count++] = source.endOf(beams[i].end);
        if (count == RayBatch::kSize || (i + 1 == last && count > 0)) {
          addRest(source, ends, count, num_slabs, share);
          count = 0;
        }
      }
    });
  }
}

/// Marks the misses of a batch of beams behind their first slabs.
void ScanUpdater::addRest(const BeamSource& source, const Eigen::Vector3f* ends, int count,
                          int num_slabs, Share& share) const {
  std::uint32_t left = RayBatch::all(count);
  if (hasLanes()) {
    RayBatch rays;
    computeRays(source.ray_origin, ends, count, ranges_.max_range_m, rays);
    left &= ~markSlabs(rays, base_, share.marks, num_slabs);
  }
  for (; left != 0; left &= left - 1) {
    Ray ray;
    bool is_cut = false;
    if (cutRay(source, ends[__builtin_ctz(left)], ray, is_cut)) {
      (void)walkRay(ray, BrickCursor(ray, base_, share.marks));
    }
  }
}

}  // namespace cuboid_mapping
