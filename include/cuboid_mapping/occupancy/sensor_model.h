// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace cuboid_mapping {

/// log(p / (1 - p)); minus or plus infinity at 0 and 1. octomap::logodds.
[[nodiscard]] float toLogOdds(double probability);

/// Inverse of toLogOdds. octomap::probability.
[[nodiscard]] double toProbability(float log_odds);

/// Class of a voxel. Unknown: no cuboid holds it. It is never "probability 0.5".
enum class Occupancy : unsigned char { kUnknown, kFree, kOccupied };

/// Name of a class: "unknown", "free" or "occupied".
[[nodiscard]] const char* toString(Occupancy occupancy);

/// Class of a known voxel: occupied if its log-odds are >= 0, else free, as in
/// octomap::AbstractOccupancyOcTree::isNodeOccupied.
[[nodiscard]] constexpr Occupancy classify(float log_odds) {
  return log_odds >= 0.0F ? Occupancy::kOccupied : Occupancy::kFree;
}

/// Bounds of the probabilities for occupied in a sensor model; the bounds for free have the same
/// distance from 0.5. Beyond them SensorModel's rounding does not hold.
///@{
constexpr double kLeastOccupied = 0.50001;
constexpr double kMostOccupied = 0.9995;
///@}

/// Parameters of the inverse sensor model (paper, Section V), as probabilities.
struct SensorModelConfig {
  double hit = 0.7;         ///< P_occ: a beam ends in the voxel. 0.50001 to 0.9995.
  double miss = 0.4;        ///< P_free: a beam passes the voxel. 0.0005 to 0.49999.
  double alpha_min = 0.12;  ///< Lower clamping threshold: 0.0005 to 0.49999.
  double alpha_max = 0.97;  ///< Upper clamping threshold: 0.50001 to 0.9995.
};

/// Whether all four are the same.
///@{
constexpr bool operator==(const SensorModelConfig& a, const SensorModelConfig& b) {
  return a.hit == b.hit && a.miss == b.miss && a.alpha_min == b.alpha_min &&
         a.alpha_max == b.alpha_max;
}
constexpr bool operator!=(const SensorModelConfig& a, const SensorModelConfig& b) {
  return !(a == b);
}
///@}

/// Whether stable cells are still updated.
enum class Environment : unsigned char {
  kDynamic,  ///< Every observation counts, voxel by voxel as in OctoMap.
  kStatic,   ///< A cell at or beyond a clamping threshold is never updated again (the paper).
};

/// Name of an environment: "dynamic" or "static".
[[nodiscard]] const char* toString(Environment environment);

/// Binary Bayes filter of one voxel in log-odds form, clamped (paper, Section IV-A).
///
/// Hit, miss and thresholds are rounded to multiples of 2^-20 (an error below 5e-7), so that sums
/// of them are exact in float: voxels with the same counts get the same value whatever the order,
/// and can fuse. Valid while |log-odds| < 8. Value type, thread-safe.
class SensorModel {
 public:
  /// @pre checkConfig() finds nothing in `config`.
  explicit SensorModel(const SensorModelConfig& config = {},
                       Environment environment = Environment::kDynamic);

  /// Log-odds that a hit adds, > 0.
  [[nodiscard]] float hit() const { return hit_; }
  /// Log-odds that a miss adds, < 0.
  [[nodiscard]] float miss() const { return miss_; }
  /// Lower clamping threshold, log-odds < 0.
  [[nodiscard]] float min() const { return min_; }
  /// Upper clamping threshold, log-odds > 0.
  [[nodiscard]] float max() const { return max_; }
  /// Whether stable voxels are updated.
  [[nodiscard]] Environment environment() const { return environment_; }

  /// Whether log-odds are at or beyond a clamping threshold (paper, Section IV-B: stable).
  [[nodiscard]] bool isStable(float log_odds) const { return log_odds <= min_ || log_odds >= max_; }

  /// Log-odds after one observation.
  ///
  /// Cases:
  ///   - static environment and stable: unchanged;
  ///   - else: clamp(log_odds + observation, min, max).
  /// A voxel that is seen for the first time starts at 0.
  ///
  /// @param observation hit() or miss().
  [[nodiscard]] float update(float log_odds, float observation) const {
    if (environment_ == Environment::kStatic && isStable(log_odds)) return log_odds;
    const float sum = log_odds + observation;
    return sum < min_ ? min_ : (sum > max_ ? max_ : sum);
  }

 private:
  float hit_;
  float miss_;
  float min_;
  float max_;
  Environment environment_;
};

}  // namespace cuboid_mapping
