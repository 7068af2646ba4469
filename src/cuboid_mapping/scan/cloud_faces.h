// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/scan/beam_marks.h"
#include "cuboid_mapping/scan/face_beams.h"
#include "cuboid_mapping/scan/ray_batch.h"
#include "cuboid_mapping/scan/ray_walk.h"

#include <array>
#include <cstdint>
#include <vector>

namespace cuboid_mapping {

/// Splits the beams of a cloud into the faces of ColumnWalk.
class CloudFaces {
 public:
  /// Beams by face.
  using Parts = std::array<std::vector<FaceBeam>, kNumFaces>;

  /// @param max_range_m  Longer beams are cut, see cutBeam().
  /// @pre origin.cell().
  CloudFaces(const RayOrigin& origin, const Cell& base, double max_range_m);

  [[nodiscard]] const Face& operator[](std::size_t face) const { return faces_[face]; }
  /// The origin's voxel minus the base.
  [[nodiscard]] const Cell& start() const { return start_; }

  /// Adds beams to their faces, and marks what they pass in their last slab and not in the column where they
  /// enter that: the end, as a hit or a miss, and a voxel between two borders across. Beams that stay in the
  /// origin's slab also mark the origin's voxel.
  /// @param count  At most RayBatch::kSize. @param wanted  Beams to add.
  /// @param first_index  Of the ends in the cloud, see FaceBeam.
  /// @return Beams that need the ordinary walk, with nothing marked: not wanted, or rounding may decide where
  /// they end, or they count as out of range or too far.
  [[nodiscard]] std::uint32_t add(const Eigen::Vector3f* ends, int count, std::uint32_t wanted,
                                  bool are_returns, std::size_t first_index, Parts& parts,
                                  BeamMarks& marks) const;

 private:
  struct Batch;

  void setUp(Batch& batch) const;
  void setUpWide(Batch& batch) const;
  void setUpBeams(Batch& batch) const;
  void cutEnds(Batch& batch) const;
  void findFaces(Batch& batch) const;
  void findEnds(Batch& batch) const;
  void findPlanes(Batch& batch) const;
  static void findLastSlabs(Batch& batch);

  const RayOrigin& origin_;
  Cell base_;
  double max_range_m_;
  Cell start_;
  std::array<Face, kNumFaces> faces_;
};

}  // namespace cuboid_mapping
