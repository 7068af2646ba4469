// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/occupancy/sensor_model.h"

#include <cassert>
#include <cmath>

namespace cuboid_mapping {
namespace {

/// Rounds to a multiple of 2^-20.
float roundLogOdds(float log_odds) {
  constexpr double kSteps = 1 << 20;
  return static_cast<float>(std::round(log_odds * kSteps) / kSteps);
}

}  // namespace

float toLogOdds(double probability) {
  return static_cast<float>(std::log(probability / (1.0 - probability)));
}

double toProbability(float log_odds) { return 1.0 - 1.0 / (1.0 + std::exp(log_odds)); }

const char* toString(Environment environment) {
  return environment == Environment::kStatic ? "static" : "dynamic";
}

const char* toString(Occupancy occupancy) {
  switch (occupancy) {
    case Occupancy::kFree: return "free";
    case Occupancy::kOccupied: return "occupied";
    case Occupancy::kUnknown: break;
  }
  return "unknown";
}

SensorModel::SensorModel(const SensorModelConfig& config, Environment environment)
    : hit_(roundLogOdds(toLogOdds(config.hit))),
      miss_(roundLogOdds(toLogOdds(config.miss))),
      min_(roundLogOdds(toLogOdds(config.alpha_min))),
      max_(roundLogOdds(toLogOdds(config.alpha_max))),
      environment_(environment) {
  assert(hit_ > 0.0F && miss_ < 0.0F && min_ < 0.0F && max_ > 0.0F);
}

}  // namespace cuboid_mapping
