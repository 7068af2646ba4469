// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/scan/beam_samples.h"

#include "cuboid_mapping/scan/ray_walk.h"

#include <algorithm>
#include <random>

namespace cuboid_mapping {
namespace {

class BeamSampler {
 public:
  BeamSampler(const Grid& grid, const Scan& scan, double max_range_m, double per_m,
              std::uint64_t seed)
      : grid_(grid),
        origin_map_(scan.anchor_map + scan.origin.cast<double>()),
        anchor_map_(scan.anchor_map),
        max_range_m_(max_range_m),
        per_m_(per_m),
        random_(seed) {}

  void sample(const std::vector<Eigen::Vector3f>& ends) {
    for (const Eigen::Vector3f& end : ends) {
      const Eigen::Vector3d beam = anchor_map_ + end.cast<double>() - origin_map_;
      const double length_m = beam.norm();
      if (!(length_m > 0.0)) continue;
      const double observed = std::min(1.0, max_range_m_ / length_m);
      // Rounded at random, so that short beams get their share.
      const double wanted = observed * length_m * per_m_ + draw();
      if (wanted < 1.0 || !grid_.toCell(origin_map_ + beam)) continue;
      if (!isTaken(observed * beam)) continue;
      const auto count = static_cast<std::int64_t>(wanted);
      for (std::int64_t i = 0; i < count; ++i) {
        const auto cell = grid_.toCell(origin_map_ + draw() * observed * beam);
        if (cell) cells_.push_back(*cell);
      }
    }
  }

  [[nodiscard]] std::vector<Cell> takeCells() {
    std::sort(cells_.begin(), cells_.end());
    cells_.erase(std::unique(cells_.begin(), cells_.end()), cells_.end());
    return std::move(cells_);
  }

 private:
  /// Whether ScanUpdater accepts the beam; this also bounds the number of its samples.
  [[nodiscard]] bool isTaken(const Eigen::Vector3d& observed_beam) const {
    const auto start = grid_.toCell(origin_map_);
    const auto end = grid_.toCell(origin_map_ + observed_beam);
    return start && end && isWithinReach(*start, *end);
  }

  /// Random number in [0, 1). The standard leaves the results of std::uniform_real_distribution open.
  double draw() { return static_cast<double>(random_() >> 11) * 0x1p-53; }

  Grid grid_;
  Eigen::Vector3d origin_map_;
  Eigen::Vector3d anchor_map_;
  double max_range_m_;
  double per_m_;
  std::mt19937_64 random_;
  std::vector<Cell> cells_;
};

}  // namespace

std::vector<Cell> sampleBeams(const Grid& grid, const Scan& scan, double max_range_m,
                              const BeamSampling& sampling, std::uint64_t number) {
  if (sampling.per_m <= 0.0) return {};
  constexpr std::uint64_t kGoldenRatio = 0x9E3779B97F4A7C15ULL;
  BeamSampler sampler(grid, scan, max_range_m, sampling.per_m,
                      static_cast<std::uint64_t>(sampling.seed) + number * kGoldenRatio);
  sampler.sample(scan.points);
  sampler.sample(scan.no_returns);
  return sampler.takeCells();
}

}  // namespace cuboid_mapping
