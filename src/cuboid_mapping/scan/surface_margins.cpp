// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/scan/surface_margins.h"

#include "cuboid_mapping/parallel/parallel_for.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace cuboid_mapping {
namespace {

constexpr float kPi = 3.14159265F;
/// Directions are a degree apart.
constexpr int kColumns = 360;
constexpr float kPixelsPerRad = 180.0F / kPi;
/// Neighbours are at most 6 degrees apart.
constexpr int kMaxStep = 6;
/// So far beside an end a beam without a return may pass what ends there.
constexpr int kEdgeStep = 5;
/// The image has a margin of kMaxStep on all sides. That of the columns repeats those of the other side.
constexpr int kRows = 181 + 2 * kMaxStep;
constexpr int kMiddleRow = kRows / 2;
constexpr int kStride = kColumns + 2 * kMaxStep;
constexpr int kMiddleColumn = kStride / 2;
/// Pixel of ends that have no direction: empty.
constexpr std::int32_t kNoPixel = 0;
/// In reaches: a longer gap between two neighbours is one of a surface only if the nearer one is grazed, too.
constexpr float kMaxGap = 5.0F;
/// In reaches: shorter parts are noise.
constexpr float kMinMargin = 2.0F;

/// Four pixels of a row.
using Floats = float __attribute__((vector_size(16)));
using Flags = std::int32_t __attribute__((vector_size(16)));

Floats loadFour(const float* from) {
  Floats four;
  std::memcpy(&four, from, sizeof(four));
  return four;
}

bool hasAny(const Flags& flags) {
  std::uint64_t halves[2];
  std::memcpy(halves, &flags, sizeof(halves));
  return (halves[0] | halves[1]) != 0;
}

Floats absolute(const Floats& numbers) { return numbers < 0.0F ? -numbers : numbers; }

/// Length of (a, b), 4 % off.
Floats lengthOf(const Floats& a, const Floats& b) {
  return a > b ? 0.96F * a + 0.4F * b : 0.96F * b + 0.4F * a;
}

/// Four points in polar coordinates, by polynomials, 1e-5 off.
struct Polar {
  Floats length;
  Floats arc_rad;
};

/// @pre x >= 0 and y >= 0.
Polar toPolar(const Floats& x, const Floats& y) {
  const Flags is_steep = y > x;
  const Floats longer = (is_steep ? y : x) + std::numeric_limits<float>::min();
  const Floats tangent = (is_steep ? x : y) / longer;
  const Floats squared = tangent * tangent;
  const Floats length =
      longer * (1.0000111F +
                squared * (0.4994047F + squared * (-0.1197238F +
                                                   squared * (0.0448648F - squared * 0.0103518F))));
  const Floats arc_rad =
      tangent *
      (0.9998660F +
       squared *
           (-0.3302995F + squared * (0.1801410F + squared * (-0.0851330F + squared * 0.0208351F))));
  return {length, is_steep ? kPi / 2 - arc_rad : arc_rad};
}

/// Directions of four ends.
struct Directions {
  Floats ranges_m;
  Floats elevations;  ///< In rows.
  Flags pixels;       ///< kNoPixel: too near, too far, or not finite.
};

/// @param x, y, z  Of the ends, from the sensor.
Directions directionsOf(const Floats& x, const Floats& y, const Floats& z) {
  constexpr float kMinRange_m = 1e-12F;
  constexpr float kMaxRange_m = 1e12F;
  const Polar flat = toPolar(absolute(x), absolute(y));
  const Polar beam = toPolar(flat.length, absolute(z));
  const Floats from_back = x < 0.0F ? kPi - flat.arc_rad : flat.arc_rad;
  const Floats column = float{kMiddleColumn} + (y < 0.0F ? -from_back : from_back) * kPixelsPerRad;
  const Floats row = float{kMiddleRow} + (z < 0.0F ? -beam.arc_rad : beam.arc_rad) * kPixelsPerRad;
  const Flags has_direction = (beam.length > kMinRange_m) & (beam.length < kMaxRange_m);
  const Flags row_index = __builtin_convertvector((has_direction ? row : Floats{}) + 0.5F, Flags);
  const Flags column_index =
      __builtin_convertvector((has_direction ? column : Floats{}) + 0.5F, Flags);
  const Flags wrap = (column_index == kStride - kMaxStep) & kColumns;
  return {beam.length, row, row_index * kStride + column_index - wrap};
}

/// Where four beams come within reach of the surface that their neighbours of one side hit.
class SideWalk {
 public:
  /// @param ranges_m  Of the beams; 0: no beam.
  SideWalk(const Floats& ranges_m, float reach_m, bool is_vertical)
      : along_m_(ranges_m),
        across_m_{},
        is_open_(ranges_m > 0.0F),
        is_held_{},
        held_along_m_{},
        held_across_m_{},
        reach_m_(reach_m),
        is_vertical_(is_vertical) {}

  [[nodiscard]] bool isDone() const { return !hasAny(is_open_); }
  [[nodiscard]] const Floats& begins() const { return along_m_; }

  /// Goes on to the next pixel. @param ranges_m  0: none. @param angles_rad  From the beams.
  void step(const Floats& ranges_m, const Floats& angles_rad) {
    Flags is_end = is_open_ & (ranges_m > 0.0F);
    const Floats along_m = ranges_m - 0.5F * ranges_m * angles_rad * angles_rad;
    const Floats across_m = ranges_m * angles_rad;
    if (hasAny(is_held_)) {
      const Flags is_next = is_end & is_held_;
      const Flags is_grazed = isGrazed(along_m, across_m);
      is_open_ &= is_grazed | ~is_next;  // Else something stands before the surface.
      accept(held_along_m_, held_across_m_, is_next & is_grazed);
      is_held_ &= ~is_next;
      is_end &= is_open_;
    }
    const Flags is_gap = is_end & (along_m_ - along_m > kMaxGap * reach_m_);
    if (hasAny(is_gap)) {
      held_along_m_ = is_gap ? along_m : held_along_m_;
      held_across_m_ = is_gap ? across_m : held_across_m_;
      is_held_ |= is_gap;
    }
    accept(along_m, across_m, is_end & ~is_gap);
  }

 private:
  /// Whether the surface between the ends that are held and the next is grazed: it rises by at most 1 in 2. A slab so
  /// thin that the beam below it passes it counts, too; beside a beam it would be a post.
  [[nodiscard]] Flags isGrazed(const Floats& along_m, const Floats& across_m) const {
    const Floats rise_m = across_m - held_across_m_;
    Flags is_grazed = held_along_m_ - along_m >= 2.0F * rise_m;
    if (is_vertical_) is_grazed |= along_m > held_along_m_;
    return is_grazed & (rise_m >= 0.0F);
  }

  void accept(const Floats& along_m, const Floats& across_m, const Flags& are_taken) {
    const Flags are_out = are_taken & (across_m > reach_m_);
    const Floats share = (reach_m_ - across_m_) / (across_m - across_m_);
    const Floats end_m = along_m_ + share * (along_m - along_m_);
    along_m_ = are_out ? end_m : (are_taken ? along_m : along_m_);
    across_m_ = are_taken ? across_m : across_m_;
    is_open_ &= ~are_out;
  }

  Floats along_m_;  ///< Of the last end, or of the place where the surface leaves the reach.
  Floats across_m_;
  Flags is_open_;
  Flags is_held_;  ///< Ends behind a gap, which are on the surface if the next one is.
  Floats held_along_m_;
  Floats held_across_m_;
  float reach_m_;
  bool is_vertical_;
};

}  // namespace

SurfaceMargins::SurfaceMargins(double reach_m, int threads)
    : reach_m_(static_cast<float>(reach_m)), threads_(threads) {
  for (std::vector<float>* image : {&ranges_m_, &elevations_, &shares_, &nearest_m_}) {
    image->resize(std::size_t{kRows} * kStride);
  }
}

/// Puts ends into the image. @param pixels  Where theirs go. @param are_surfaces  Else they are only looked up.
void SurfaceMargins::place(const std::vector<Eigen::Vector3f>& ends, const Eigen::Vector3f& origin,
                           std::int32_t* pixels, bool are_surfaces) {
  const auto last = static_cast<std::ptrdiff_t>(ends.size()) - 1;
  for (std::ptrdiff_t first = 0; first <= last; first += 4) {
    const auto ways = [&](int axis) {  // Behind the last comes the last again.
      const auto way = [&](std::ptrdiff_t i) {
        return ends[static_cast<std::size_t>(std::min(first + i, last))][axis];
      };
      return Floats{way(0), way(1), way(2), way(3)} - origin[axis];
    };
    const Directions directions = directionsOf(ways(0), ways(1), ways(2));
    for (int i = 0; i < 4; ++i) {
      const auto pixel = static_cast<std::size_t>(directions.pixels[i]);
      pixels[std::min(first + i, last)] = directions.pixels[i];
      const bool is_nearer = directions.ranges_m[i] <= ranges_m_[pixel];
      if (!are_surfaces || pixel == kNoPixel || is_nearer) continue;
      ranges_m_[pixel] = directions.ranges_m[i];
      elevations_[pixel] = directions.elevations[i];
    }
  }
}

void SurfaceMargins::closeCircle(int row) {
  for (std::vector<float>* image : {&ranges_m_, &elevations_}) {
    float* const pixels = image->data() + std::ptrdiff_t{row} * kStride;
    std::copy_n(pixels + kColumns, kMaxStep, pixels);
    std::copy_n(pixels + kMaxStep, kMaxStep, pixels + kMaxStep + kColumns);
  }
}

void SurfaceMargins::computeShares(int row) {
  const float column_rad = std::cos((row - kMiddleRow) / kPixelsPerRad) / kPixelsPerRad;
  for (int column = kMaxStep; column < kMaxStep + kColumns; column += 4) {
    const std::ptrdiff_t pixel = std::ptrdiff_t{row} * kStride + column;
    const Floats ranges_m = loadFour(&ranges_m_[static_cast<std::size_t>(pixel)]);
    if (!hasAny(ranges_m > 0.0F)) continue;
    const Floats elevations = loadFour(&elevations_[static_cast<std::size_t>(pixel)]);
    Floats begins_m = ranges_m;
    for (const int step : {-kStride, kStride, -1, 1}) {
      const bool is_vertical = std::abs(step) == kStride;
      SideWalk walk(ranges_m, reach_m_, is_vertical);
      for (int i = 1; i <= kMaxStep && !walk.isDone(); ++i) {
        const auto next = static_cast<std::size_t>(pixel + std::ptrdiff_t{step} * i);
        const Floats up_rad = absolute(loadFour(&elevations_[next]) - elevations) / kPixelsPerRad;
        const Floats beside_rad = Floats{} + column_rad * static_cast<float>(i);
        walk.step(loadFour(&ranges_m_[next]), is_vertical ? up_rad : lengthOf(up_rad, beside_rad));
      }
      begins_m = walk.begins() < begins_m ? walk.begins() : begins_m;
    }
    const Floats margins_m = ranges_m - begins_m;
    const Floats shares =
        margins_m < kMinMargin * reach_m_ ? Floats{} : (margins_m + reach_m_) / ranges_m;
    std::memcpy(&shares_[static_cast<std::size_t>(pixel)], &shares, sizeof(shares));
  }
}

/// The least of the ranges within kEdgeStep pixels of each. @param first_row, num_rows  All rows with ends.
void SurfaceMargins::findNearest(int first_row, int num_rows) {
  constexpr float kNone = std::numeric_limits<float>::infinity();
  std::fill(nearest_m_.begin(), nearest_m_.end(), kNone);
  std::vector<float> beside_m(kStride);
  for (int row = first_row; row < first_row + num_rows; ++row) {
    const float* const ranges_m = ranges_m_.data() + std::ptrdiff_t{row} * kStride;
    std::fill(beside_m.begin(), beside_m.end(), kNone);
    for (int step = -kEdgeStep; step <= kEdgeStep; ++step) {
      for (int column = kMaxStep; column < kMaxStep + kColumns; ++column) {
        const float range_m = ranges_m[column + step];
        float& least_m = beside_m[static_cast<std::size_t>(column)];
        least_m = std::min(least_m, range_m > 0.0F ? range_m : kNone);
      }
    }
    for (int step = -kEdgeStep; step <= kEdgeStep; ++step) {
      float* const nearest_m = nearest_m_.data() + std::ptrdiff_t{row + step} * kStride;
      for (int column = kMaxStep; column < kMaxStep + kColumns; ++column) {
        nearest_m[column] = std::min(nearest_m[column], beside_m[static_cast<std::size_t>(column)]);
      }
    }
  }
}

void SurfaceMargins::addNoReturns(const Scan& scan, float* shares) {
  std::vector<std::int32_t> pixels(scan.no_returns.size());
  place(scan.no_returns, scan.origin, pixels.data(), false);
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    if (pixels[i] == kNoPixel) continue;
    const float length_m = (scan.no_returns[i] - scan.origin).norm();
    const float begin_m = nearest_m_[static_cast<std::size_t>(pixels[i])] - kMinMargin * reach_m_;
    shares[i] = std::clamp((length_m - begin_m) / length_m, 0.0F, 1.0F);
  }
}

void SurfaceMargins::compute(const Scan& scan, std::vector<float>& margins) {
  std::fill_n(ranges_m_.begin() + first_filled_, num_filled_, 0.0F);
  first_filled_ = 0;  // Anywhere, if memory fails before it is known.
  num_filled_ = std::ptrdiff_t{kRows} * kStride;
  pixels_.resize(scan.points.size() + scan.open_ends.size());
  place(scan.points, scan.origin, pixels_.data(), true);
  place(scan.open_ends, scan.origin, pixels_.data() + scan.points.size(), true);
  std::int32_t first_pixel = kRows * kStride;
  std::int32_t last_pixel = kNoPixel;
  for (const std::int32_t pixel : pixels_) {
    first_pixel = std::min(first_pixel, pixel == kNoPixel ? first_pixel : pixel);
    last_pixel = std::max(last_pixel, pixel);
  }
  margins.assign(pixels_.size() + scan.no_returns.size(), 0.0F);
  if (last_pixel == kNoPixel) return;
  const int first_row = first_pixel / kStride;
  const int num_rows = last_pixel / kStride + 1 - first_row;
  first_filled_ = std::ptrdiff_t{first_row} * kStride;
  num_filled_ = std::ptrdiff_t{num_rows} * kStride;
  for (int i = 0; i < num_rows; ++i) closeCircle(first_row + i);
  parallelFor(static_cast<std::size_t>(num_rows), threads_,
              [&](std::size_t i) { computeShares(first_row + static_cast<int>(i)); });
  for (std::size_t i = 0; i < pixels_.size(); ++i) {
    margins[i] = shares_[static_cast<std::size_t>(pixels_[i])];
  }
  if (!scan.no_returns.empty()) {
    findNearest(first_row, num_rows);
    addNoReturns(scan, margins.data() + pixels_.size());
  }
}

}  // namespace cuboid_mapping
