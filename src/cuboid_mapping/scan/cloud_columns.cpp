// SPDX-License-Identifier: BSD-3-Clause
// The part of ScanUpdater that takes dense beams by columns.
#include "cuboid_mapping/parallel/parallel_for.h"
#include "cuboid_mapping/scan/brick_cursor.h"
#include "cuboid_mapping/scan/column_walk.h"
#include "cuboid_mapping/scan/scan_update.h"
#include "cuboid_mapping/scan/slab_walk.h"

#include <algorithm>
#include <atomic>
#include <cmath>

namespace cuboid_mapping {
namespace {

/// Beams of one piece of work.
constexpr std::size_t kBeamsOfPart = 4096;
/// Slabs of one piece of work. Each piece finds the columns at one plane that another finds, too.
constexpr int kSlabsOfPiece = 8;

/// Consecutive slabs of a face.
struct Piece {
  std::size_t face;
  int first;
  int last;
};

}  // namespace

template <typename AddT>
void ScanUpdater::forEachPart(std::size_t count, AddT add) {
  std::atomic<std::size_t> next{0};
  parallelFor(shares_.size(), numThreads(), [&](std::size_t i) {
    for (std::size_t part = next++; part < count; part = next++) add(part, shares_[i]);
  });
}

void ScanUpdater::addByColumns(const Scan& scan) {
  const BeamSource source{scan, RayOrigin(grid_, scan.anchor_map, scan.origin)};
  const CloudFaces faces(source.ray_origin, base_, ranges_.max_range_m);
  sortIntoFaces(source, faces);
  walkColumns(source, faces);
  walkBehindColumns(source);
}

void ScanUpdater::sortIntoFaces(const BeamSource& source, const CloudFaces& faces) {
  const Scan& scan = source.scan;
  for (Share& share : shares_) {
    for (auto& part : share.faces) part.clear();
  }
  const auto add = [&](const std::vector<Eigen::Vector3f>& ends, std::size_t first_index,
                       bool are_returns) {
    forEachPart(
        (ends.size() + kBeamsOfPart - 1) / kBeamsOfPart, [&](std::size_t part, Share& share) {
          const std::size_t last = std::min((part + 1) * kBeamsOfPart, ends.size());
          std::vector<Eigen::Vector3f> others;
          for (std::size_t i = part * kBeamsOfPart; i < last; i += RayBatch::kSize) {
            const auto count = static_cast<int>(std::min<std::size_t>(RayBatch::kSize, last - i));
            std::uint32_t left =
                faces.add(&ends[i], count, are_returns, first_index + i, share.faces, share.marks);
            share.num_points += static_cast<std::size_t>(count - __builtin_popcount(left));
            for (; left != 0; left &= left - 1) {
              others.push_back(ends[i + static_cast<std::size_t>(__builtin_ctz(left))]);
            }
          }
          addBeams(source, others.data(), others.size(), are_returns, share);
        });
  };
  add(scan.points, 0, true);
  add(scan.no_returns, scan.points.size(), false);
  parallelFor(kNumFaces, numThreads(), [&](std::size_t face) {
    std::vector<FaceBeam>& beams = shares_.front().faces[face];
    for (std::size_t i = 1; i < shares_.size(); ++i) {
      const std::vector<FaceBeam>& more = shares_[i].faces[face];
      beams.insert(beams.end(), more.begin(), more.end());
    }
    face_beams_[face].sort(faces[face], beams);
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
      Eigen::Vector3f end = source.endOf(index);
      if (std::isfinite(ranges_.max_range_m))
        (void)cutBeam(source.scan.origin, ranges_.max_range_m, end);
      Ray ray;
      if (!source.ray_origin.computeRay(end, ray)) return;
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
    Eigen::Vector3f end = ends[__builtin_ctz(left)];
    if (std::isfinite(ranges_.max_range_m))
      (void)cutBeam(source.scan.origin, ranges_.max_range_m, end);
    Ray ray;
    if (source.ray_origin.computeRay(end, ray))
      (void)walkRay(ray, BrickCursor(ray, base_, share.marks));
  }
}

}  // namespace cuboid_mapping
