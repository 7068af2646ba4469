// SPDX-License-Identifier: BSD-3-Clause
#include "peers/beams.h"
#include "peers/bonxai_grid.h"

#include <bonxai_map/probabilistic_map.hpp>

namespace cuboid_mapping::bench {
namespace {

using Bonxai::ProbabilisticMap;

float readFixedLogOdds(const ProbabilisticMap::CellT& cell) {
  return 1e-6F * static_cast<float>(cell.probability_log);
}

/// Filled as its authors do it.
class BonxaiMapAdapter : public BonxaiAdapter<ProbabilisticMap::CellT, readFixedLogOdds> {
 public:
  explicit BonxaiMapAdapter(const InsertionConfig& config)
      : max_range_m_(config.max_range_m),
        map_(std::make_unique<ProbabilisticMap>(config.map.resolution_m)) {
    const SensorModelConfig& model = config.map.sensor_model;
    ProbabilisticMap::Options options;
    options.prob_hit_log = toFixed(model.hit);
    options.prob_miss_log = toFixed(model.miss);
    options.clamp_min_log = toFixed(model.alpha_min);
    options.clamp_max_log = toFixed(model.alpha_max);
    map_->setOptions(options);
  }

  [[nodiscard]] std::string name() const override { return "bonxai_map"; }
  [[nodiscard]] bool takesAnchors() const override { return false; }

  void insert(const Scan& scan) override {
    map_->insertPointCloud(finitePoints(scan), scan.origin, max_range_m_);
  }

  void dropScratch() override {}
  void dropMap() override { map_.reset(); }

 protected:
  [[nodiscard]] const Grid& grid() const override {
    return static_cast<const ProbabilisticMap&>(*map_).grid();
  }

 private:
  static std::int32_t toFixed(double probability) {
    return ProbabilisticMap::logods(static_cast<float>(probability));
  }

  double max_range_m_;
  std::unique_ptr<ProbabilisticMap> map_;
};

}  // namespace

std::unique_ptr<PeerAdapter> makeBonxaiMapAdapter(const InsertionConfig& config) {
  return std::make_unique<BonxaiMapAdapter>(config);
}

}  // namespace cuboid_mapping::bench
