// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/scan/dense_beams.h"

#include "cuboid_mapping/scan/face_beams.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace cuboid_mapping {
namespace {

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

struct Sample {
  int field;
  float depth;
};

}  // namespace

bool areDense(const Scan& scan, const RayOrigin& origin, double max_range_m) {
  const std::size_t num_beams = scan.points.size() + scan.no_returns.size();
  const double inverse_m = origin.grid().inverseResolution();
  std::array<int, kNumFaces * kFields * kFields> counts{};
  std::vector<Sample> samples;
  samples.reserve(num_beams / kSampleStep + 1);
  for (std::size_t i = 0; i < num_beams; i += kSampleStep) {
    const Eigen::Vector3f& end =
        i < scan.points.size() ? scan.points[i] : scan.no_returns[i - scan.points.size()];
    const Eigen::Vector3f way = end - origin.point();
    int axis = std::abs(way.y()) > std::abs(way.x()) ? 1 : 0;
    if (std::abs(way.z()) > std::abs(way[axis])) axis = 2;
    const float along = std::abs(way[axis]);
    if (!(along > 0.0F && std::isfinite(along))) continue;
    int field = 2 * axis + (way[axis] < 0.0F ? 1 : 0);
    for (const int across : {axis == 0 ? 1 : 0, axis == 2 ? 1 : 2}) {
      field = kFields * field +
              std::min(static_cast<int>((way[across] / along + 1.0F) / kFieldEdge), kFields - 1);
    }
    ++counts[static_cast<std::size_t>(field)];
    const double part = std::min(1.0, max_range_m / static_cast<double>(way.norm()));
    samples.push_back({field, static_cast<float>(along * part * inverse_m)});
  }
  double cost = 0.0;
  double gain = 0.0;
  for (const Sample& sample : samples) {
    const double per_slope = counts[static_cast<std::size_t>(sample.field)] *
                             static_cast<double>(kSampleStep) / (kFieldEdge * kFieldEdge);
    const double dense = std::sqrt(per_slope / kColumn);
    const double walk = kWalkSetUp + sample.depth;
    cost += walk;
    gain -= kSort;
    // The columns that a beam shares grow with the square of the depth. Beams that end where they are sparse
    // are set up a second time there, which takes what they saved.
    if (sample.depth < dense)
      gain += walk - sample.depth * sample.depth * sample.depth / (3.0 * dense * dense);
  }
  return gain > kMinGain * cost;
}

}  // namespace cuboid_mapping
