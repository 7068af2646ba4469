// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/scan/face_beams.h"

#include <algorithm>
#include <cmath>
#include <limits>

#ifdef __SSE2__
#include <emmintrin.h>
#endif

namespace cuboid_mapping {
namespace {

/// A greater number of planes is stored as this one.
constexpr std::uint32_t kMostPlanes = std::numeric_limits<std::int16_t>::max();
/// Values behind those of a level, so that nodesThatReach() may load 64 from each.
constexpr std::size_t kOverrun = 63;
/// Bound of bins and columns that are counted.
constexpr double kFarColumn = 1 << 28;

int toInt(double number) {
  return static_cast<int>(std::min(std::max(number, -kFarColumn), kFarColumn));
}

}  // namespace

int FaceBeams::firstBin(double slope, std::size_t across) const {
  return std::max(toInt(std::floor((slope - least_[across]) * bins_per_slope_)), 0);
}

int FaceBeams::lastBin(double slope, std::size_t across) const {
  return std::min(toInt(std::floor((slope - least_[across]) * bins_per_slope_)),
                  levels_.front().size[across] - 1);
}

int FaceBeams::firstWholeBin(double slope, std::size_t across) const {
  return toInt(std::ceil((slope - least_[across]) * bins_per_slope_));
}

int FaceBeams::lastWholeBin(double slope, std::size_t across) const {
  return toInt(std::floor((slope - least_[across]) * bins_per_slope_)) - 1;
}

std::array<int, 2> FaceBeams::columnsAt(double depth, std::size_t across) const {
  const double margin = acrossMargin(depth);
  const double origin = face_.origin[across];
  return {toInt(std::floor(origin + least_[across] * depth - margin)),
          toInt(std::floor(origin + greatest_[across] * depth + margin))};
}

int FaceBeams::levelOf(double slopes, double num_nodes) const {
  int level = 0;
  for (double bins = slopes * bins_per_slope_; bins >= num_nodes && level + 1 < numLevels();
       bins /= 2) {
    ++level;
  }
  return level;
}

std::uint64_t FaceBeams::nodesThatReach(int level, int x, int y, int plane) const {
  const Level& nodes = levels_[static_cast<std::size_t>(level)];
  if (x >= nodes.size[0] || y >= nodes.size[1]) return 0;
  const std::int16_t* row =
      nodes.most_planes.data() + static_cast<std::ptrdiff_t>(y) * nodes.size[0] + x;
  const int count = std::min(nodes.size[0] - x, 64);
  std::uint64_t bits = 0;
#ifdef __SSE2__
  const __m128i limit = _mm_set1_epi16(static_cast<std::int16_t>(plane));
  for (int i = 0; i < count; i += 16) {
    const auto* from = reinterpret_cast<const __m128i*>(row + i);
    const __m128i low = _mm_cmpgt_epi16(_mm_loadu_si128(from), limit);
    const __m128i high = _mm_cmpgt_epi16(_mm_loadu_si128(from + 1), limit);
    bits |= static_cast<std::uint64_t>(_mm_movemask_epi8(_mm_packs_epi16(low, high))) << i;
  }
#else
  for (int i = 0; i < count; ++i) bits |= std::uint64_t{row[i] > plane} << i;
#endif
  return bits & ~std::uint64_t{0} >> (64 - count);
}

bool FaceBeams::anyReaches(int level, const Bins& nodes, int plane) const {
  const Level& of = levels_[static_cast<std::size_t>(level)];
  const int last_x = std::min(nodes.last[0], of.size[0] - 1);
  const int last_y = std::min(nodes.last[1], of.size[1] - 1);
  for (int y = std::max(nodes.first[1], 0); y <= last_y; ++y) {
    const std::int16_t* row = of.most_planes.data() + static_cast<std::ptrdiff_t>(y) * of.size[0];
    for (int x = std::max(nodes.first[0], 0); x <= last_x; ++x) {
      if (row[x] > plane) return true;
    }
  }
  return false;
}

void FaceBeams::chooseBins() {
  constexpr double kBeamsOfBin = 2.0;
  constexpr double kMaxBinsOfAxis = 4096.0;
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  // Of every fourth beam each, so that a minimum need not wait for the one before.
  constexpr std::size_t kLanes = 4;
  std::array<std::array<float, kLanes>, 2> least{};
  std::array<std::array<float, kLanes>, 2> greatest{};
  for (std::size_t i = 0; i < 2; ++i) {
    least[i].fill(kInfinity);
    greatest[i].fill(-kInfinity);
  }
  const std::size_t num_beams = beams_.size();
  for (std::size_t beam = 0; beam < num_beams; beam += kLanes) {
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      const FaceBeam& of = beams_[std::min(beam + lane, num_beams - 1)];
      for (std::size_t i = 0; i < 2; ++i) {
        least[i][lane] = std::min(least[i][lane], of.slopes[i]);
        greatest[i][lane] = std::max(greatest[i][lane], of.slopes[i]);
      }
    }
  }
  for (std::size_t i = 0; i < 2; ++i) {
    least_[i] = *std::min_element(least[i].begin(), least[i].end());
    greatest_[i] = *std::max_element(greatest[i].begin(), greatest[i].end());
  }
  const double width = greatest_[0] - least_[0];
  const double height = greatest_[1] - least_[1];
  const double edge =
      std::max({std::sqrt(kBeamsOfBin * width * height / static_cast<double>(beams_.size())),
                std::max(width, height) / kMaxBinsOfAxis, 1e-6});
  bins_per_slope_ = static_cast<float>(1.0 / edge);
  levels_.resize(1);
  for (std::size_t i = 0; i < 2; ++i) levels_[0].size[i] = binOf(greatest_[i], i) + 1;
}

void FaceBeams::sort(const Face& face, std::vector<FaceBeam>& beams) {
  face_ = face;
  num_dense_planes_ = 0;
  beams_.swap(beams);
  if (beams_.empty()) return;
  chooseBins();
  Level& bins = levels_.front();
  const auto num_bins =
      static_cast<std::size_t>(bins.size[0]) * static_cast<std::size_t>(bins.size[1]);
  first_beams_.assign(num_bins, kNone);
  next_beams_.resize(beams_.size());
  bins.most_planes.assign(num_bins + kOverrun, 0);
  for (std::size_t i = 0; i < beams_.size(); ++i) {
    const FaceBeam& beam = beams_[i];
    const auto bin = static_cast<std::size_t>(binOf(beam.slopes[1], 1)) *
                         static_cast<std::size_t>(bins.size[0]) +
                     static_cast<std::size_t>(binOf(beam.slopes[0], 0));
    next_beams_[i] = first_beams_[bin];
    first_beams_[bin] = static_cast<std::uint32_t>(i);
    const auto planes = static_cast<std::int16_t>(std::min(beam.num_planes, kMostPlanes));
    bins.most_planes[bin] = std::max(bins.most_planes[bin], planes);
  }
  buildPyramid();
  countDensePlanes();
}

void FaceBeams::buildPyramid() {
  while (levels_.back().size[0] > 1 || levels_.back().size[1] > 1) {
    const Level& below = levels_.back();
    Level level{{(below.size[0] + 1) / 2, (below.size[1] + 1) / 2}, {}};
    level.most_planes.reserve(static_cast<std::size_t>(level.size[0]) *
                                  static_cast<std::size_t>(level.size[1]) +
                              kOverrun);
    for (int y = 0; y < level.size[1]; ++y) {
      const auto* row = below.most_planes.data() + std::ptrdiff_t{2 * y} * below.size[0];
      const auto* next = 2 * y + 1 < below.size[1] ? row + below.size[0] : row;
      for (int x = 0; x < level.size[0]; ++x) {
        const int right = std::min(2 * x + 1, below.size[0] - 1);
        level.most_planes.push_back(
            std::max(std::max(row[2 * x], row[right]), std::max(next[2 * x], next[right])));
      }
    }
    level.most_planes.resize(level.most_planes.size() + kOverrun, 0);
    levels_.push_back(std::move(level));
  }
}

/// Compares the number of beams with that of nodes that are as wide as a column, level by level.
void FaceBeams::countDensePlanes() {
  std::vector<std::size_t> crossing(static_cast<std::size_t>(maxPlanes()) + 1, 0);  // By plane.
  constexpr std::size_t kCountedBeam = 32;  // One of so many.
  for (std::size_t i = 0; i < beams_.size(); i += kCountedBeam) {
    crossing[std::min(beams_[i].num_planes, kMostPlanes) - 1] += kCountedBeam;
  }
  for (std::size_t i = crossing.size() - 1; i > 0; --i) crossing[i - 1] += crossing[i];
  double dense_depth = 0.0;
  double dense_ratio = std::numeric_limits<double>::infinity();
  const auto max_planes = static_cast<double>(crossing.size() - 1);
  for (int level = numLevels() - 1; level >= 0; --level) {
    const double depth = bins_per_slope_ / (1 << level);
    if (depth >= max_planes) {
      dense_depth = std::min(max_planes, dense_depth * std::sqrt(dense_ratio / kMinBeamsPerColumn));
      break;
    }
    const auto plane = static_cast<int>(depth);
    std::size_t num_nodes = 0;
    for (const std::int16_t planes : levels_[static_cast<std::size_t>(level)].most_planes) {
      if (planes > plane) ++num_nodes;
    }
    const double ratio = static_cast<double>(crossing[static_cast<std::size_t>(plane)]) /
                         static_cast<double>(num_nodes);
    if (ratio < kMinBeamsPerColumn) {
      if (std::isfinite(dense_ratio)) {
        const double part =
            std::log(dense_ratio / kMinBeamsPerColumn) / std::log(dense_ratio / ratio);
        dense_depth *= std::exp2(part);
      }
      break;
    }
    dense_depth = depth;
    dense_ratio = ratio;
  }
  num_dense_planes_ = static_cast<int>(dense_depth);
}

}  // namespace cuboid_mapping
