// SPDX-License-Identifier: BSD-3-Clause
#include "peers/ohm_map.h"

#include "cuboid_mapping/scan/ray_walk.h"

#include <ohm/RayMapperOccupancy.h>

#include <cmath>

namespace cuboid_mapping::bench {
namespace {

/// Filled as its authors do it.
class OhmRayAdapter : public OhmAdapter {
 public:
  explicit OhmRayAdapter(const InsertionConfig& config)
      : OhmAdapter(config.map),
        max_range_m_(config.max_range_m),
        mapper_(std::make_unique<ohm::RayMapperOccupancy>(&map())) {}

  [[nodiscard]] std::string name() const override { return "ohm_rays"; }

  void insert(const Scan& scan) override {
    returns_.clear();
    cut_.clear();
    for (const Eigen::Vector3f& point : scan.points) {
      Eigen::Vector3f end = point;
      const bool is_cut = std::isfinite(max_range_m_) && cutBeam(scan.origin, max_range_m_, end);
      Rays& rays = is_cut ? cut_ : returns_;
      rays.push_back(toVec3(scan.anchor_map + scan.origin.cast<double>()));
      rays.push_back(toVec3(scan.anchor_map + end.cast<double>()));
    }
    integrate(cut_, ohm::kRfEndPointAsFree);
    integrate(returns_, ohm::kRfDefault);
  }

  void dropScratch() override {
    mapper_.reset();
    returns_ = Rays();
    cut_ = Rays();
  }

 private:
  using Rays = std::vector<glm::dvec3>;  ///< Start and end of each beam.

  void integrate(const Rays& rays, unsigned flags) {
    mapper_->integrateRays(rays.data(), rays.size(), nullptr, nullptr, flags);
  }

  double max_range_m_;
  std::unique_ptr<ohm::RayMapperOccupancy> mapper_;
  Rays returns_;
  Rays cut_;
};

}  // namespace

std::unique_ptr<PeerAdapter> makeOhmRaysAdapter(const InsertionConfig& config) {
  return std::make_unique<OhmRayAdapter>(config);
}

}  // namespace cuboid_mapping::bench
