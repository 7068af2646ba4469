// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/geometry/grid.h"
#include "cuboid_mapping/parallel/parallel_for.h"
#include "cuboid_mapping/scan/beam_marks.h"
#include "cuboid_mapping/scan/beam_samples.h"
#include "cuboid_mapping/scan/brick_update.h"
#include "cuboid_mapping/scan/cloud_faces.h"
#include "cuboid_mapping/scan/ray_batch.h"
#include "cuboid_mapping/scan/ray_walk.h"
#include "cuboid_mapping/scan/scan.h"
#include "cuboid_mapping/scan/slab_walk.h"
#include "cuboid_mapping/scan/surface_margins.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

namespace cuboid_mapping {

/// Reduces an update to that of a sensor that only marks, by removing its misses; or only clears, by removing
/// its hits, whose voxels then are not observed.
///@{
void keepMarks(ScanUpdate& update);
void keepClears(ScanUpdate& update);
///@}

/// When ColumnWalk takes the part of a cloud where beams are dense. The update is the same.
enum class ColumnUse {
  kWhereCheaper,
  kNever,   ///< For tests.
  kAlways,  ///< For tests.
};

/// Computes the voxels that a cloud observes, see ScanUpdate. Does not read the map.
///
/// Not thread-safe; reuses its buffers.
class ScanUpdater {
 public:
  /// @param threads  >= 1; the update does not depend on it.
  /// @param sampling  Sampling of cells along the beams; none by default.
  ///@{
  explicit ScanUpdater(const Grid& grid, const BeamRanges& ranges = {}, int threads = 1,
                       const BeamSampling& sampling = {});
  ScanUpdater(const Grid& grid, double max_range_m, int threads = 1,
              const BeamSampling& sampling = {})
      : ScanUpdater(grid, BeamRanges{max_range_m}, threads, sampling) {}
  ///@}

  /// The observations of a scan. @return Valid until the next call.
  /// @complexity O(voxels passed), and O(b log b) for b touched bricks.
  const ScanUpdate& compute(const Scan& scan) { return compute(&scan, 1); }

  /// One observation of scans from several places, for a sensor that moves while it measures.
  /// @param first  The first of `count` scans, whose sensor lies within 200 km of all others at 0.05 m (4
  ///               million voxels); scans beyond count as too far.
  const ScanUpdate& compute(const Scan* first, std::size_t count);

  /// Swaps the last update with another object, whose memory is reused.
  void swapUpdate(ScanUpdate& update) { std::swap(update_, update); }

  /// Has compute() throw std::runtime_error soon after this has become true.
  void cancelWhen(const std::atomic<bool>& is_cancelled) { is_cancelled_ = &is_cancelled; }
  void setColumnUse(ColumnUse use) { column_use_ = use; }
  /// Slabs that ColumnWalk took in the last update, of all faces: 0 if all beams were walked one by one.
  [[nodiscard]] std::size_t numColumnSlabs() const { return num_column_slabs_; }

 private:
  /// One thread's masks of a brick, and its place along the Morton curve.
  struct PlacedMarks {
    std::uint64_t morton;
    BrickKey key;
    const BrickMarks* marks;
    bool are_grazes;
  };

  /// Results of one thread.
  struct Share {
    BeamMarks marks;
    BeamMarks grazes;  ///< Marks without hits; empty without an end margin and keep_surfaces.
    std::vector<PlacedMarks> order;  ///< Order of all its bricks.
    CloudFaces::Parts faces;         ///< Beams of the current scan that ColumnWalk may take.
    std::size_t num_points = 0;
    std::size_t num_out_of_range = 0;
    std::size_t num_too_far = 0;

    void clear();
  };

  /// Common data of the beams of a scan.
  struct BeamSource {
    const Scan& scan;
    RayOrigin ray_origin;

    /// @param index  In the returns, then the no-returns.
    [[nodiscard]] const Eigen::Vector3f& endOf(std::size_t index) const {
      const std::size_t num_points = scan.points.size();
      return index < num_points ? scan.points[index] : scan.no_returns[index - num_points];
    }
  };

  enum class BeamKind { kReturn, kNoReturn, kOpenEnd };

  /// Beams of one kind of a scan.
  struct Beams {
    const Eigen::Vector3f* ends;
    const float* margins;  ///< Of each, see SurfaceMargins; null: none.
    std::size_t count;
    BeamKind kind;

    [[nodiscard]] Beams part(std::size_t first, std::size_t last) const {
      return {ends + first, margins == nullptr ? nullptr : margins + first, last - first, kind};
    }
    [[nodiscard]] float marginOf(std::size_t beam) const {
      return margins == nullptr ? 0.0F : margins[beam];
    }
  };

  /// Whether every voxel of a beam from an origin has a key.
  [[nodiscard]] bool isWithinKeyRange(const RayOrigin& origin) const;
  void markBeam(const Ray& ray, double margin_m, BeamKind kind, bool is_cut, Share& share) const;
  /// End margin of a beam, which is not cut unless it is a no-return; 0: none.
  [[nodiscard]] double marginOf(const BeamSource& source, const Beams& beams, std::size_t beam,
                                double length_m) const;
  [[nodiscard]] double endMargin(float share, double length_m) const {
    return std::max(share * length_m, ranges_.end_margin_m);
  }
  [[nodiscard]] bool hasMargins() const {
    return ranges_.end_margin_m > 0.0 || ranges_.keep_surfaces;
  }
  [[nodiscard]] BatchMargins marginsOf(const BeamSource& source, const Beams& batch,
                                       const RayBatch& rays, Share& share) const;
  [[nodiscard]] std::uint32_t addBatch(const BeamSource& source, const Beams& batch,
                                       Share& share) const;
  /// Sets up the beam to a point, cut at the maximum range. @return As RayOrigin::computeRay().
  bool cutRay(const BeamSource& source, Eigen::Vector3f end, Ray& ray, bool& is_cut) const {
    is_cut =
        std::isfinite(ranges_.max_range_m) && cutBeam(source.scan.origin, ranges_.max_range_m, end);
    return source.ray_origin.computeRay(end, ray);
  }
  void addBeam(const BeamSource& source, const Beams& beams, std::size_t beam, Share& share) const;
  void addBeams(const BeamSource& source, const Beams& beams, Share& share) const;
  /// @param margins  Of the scan, see SurfaceMargins; null: none.
  ///@{
  [[nodiscard]] static Beams beamsOf(const Scan& scan, BeamKind kind, const float* margins);
  [[nodiscard]] bool usesColumns(const Scan& scan, const float* margins) const;
  /// Adds the returns and no-returns of a scan.
  void addByColumns(const Scan& scan, const float* margins);
  ///@}
  void sortIntoFaces(const BeamSource& source, const Beams& beams, std::size_t first_index,
                     const CloudFaces& faces);
  void walkColumns(const BeamSource& source, const CloudFaces& faces);
  void walkBehindColumns(const BeamSource& source);
  void addRest(const BeamSource& source, const Eigen::Vector3f* ends, int count, int num_slabs,
               Share& share) const;
  [[nodiscard]] bool isCancelled() const { return is_cancelled_ != nullptr && *is_cancelled_; }
  /// Calls add(i, share) for each i in [0, count), on all threads. @throws std::runtime_error  See cancelWhen().
  template <typename AddT>
  void forEachPart(std::size_t count, AddT add) {
    std::atomic<std::size_t> next{0};
    parallelFor(shares_.size(), numThreads(), [&](std::size_t i) {
      for (std::size_t part = next++; part < count && !isCancelled(); part = next++) {
        add(part, shares_[i]);
      }
    });
    if (isCancelled()) throw std::runtime_error("cancelled, because the program ends");
  }
  /// Adds part `part` of `num_parts` of a scan. @param by_columns  Whether addByColumns() adds the rest of it.
  void addScan(const Scan& scan, const float* margins, bool by_columns, std::size_t part,
               std::size_t num_parts, Share& share) const;
  void addFreePoints(const RayOrigin& ray_origin, const std::vector<Eigen::Vector3f>& points,
                     BeamMarks& marks) const;
  static bool isBefore(const PlacedMarks& a, const PlacedMarks& b) { return a.morton < b.morton; }
  void sortMarks(Share& share) const;
  void collectBricks();
  [[nodiscard]] BrickUpdate unite(const PlacedMarks* first, const PlacedMarks* last) const;
  [[nodiscard]] int numThreads() const { return static_cast<int>(shares_.size()); }

  Grid grid_;
  BeamRanges ranges_;
  Cell first_origin_;  ///< Origin of the first scan of the cloud that lies in the grid.
  Cell base_;          ///< Cell from which the keys of its bricks count.
  std::vector<Share> shares_;
  std::optional<SurfaceMargins> surfaces_;   ///< With keep_surfaces.
  std::vector<std::vector<float>> margins_;  ///< SurfaceMargins of each scan of a cloud.
  BeamSampling sampling_;
  std::array<FaceBeams, kNumFaces> face_beams_;
  const std::atomic<bool>* is_cancelled_ = nullptr;
  ColumnUse column_use_ = ColumnUse::kWhereCheaper;
  std::size_t num_column_slabs_ = 0;
  std::uint64_t num_scans_ = 0;
  ScanUpdate update_;
};

}  // namespace cuboid_mapping
