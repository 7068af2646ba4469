// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/map/mapper.h"

#include "cuboid_mapping/parallel/parallel_for.h"
#include "cuboid_mapping/scan/scan_update.h"

#include <utility>

namespace cuboid_mapping {

struct Mapper::Implementation {
  explicit Implementation(const MapperConfig& config)
      : map(checked(config).map),
        updater(map.grid(), BeamRanges{config.max_range_m, config.end_margin_m}, config.map.threads,
                config.map.beamSampling()) {}

  void startApply() {
    const auto apply = [this] { map.apply(update); };
    if (map.config().threads > 1 && !is_map_given) {
      applying = BackgroundWork(apply);
    } else {
      apply();
    }
  }

  CuboidMap map;
  ScanUpdater updater;
  ScanUpdate update;          ///< Update of the scan that goes into the map.
  bool is_map_given = false;  ///< The caller has the map, and may read it between calls.
  BackgroundWork applying;    ///< Last member: it ends before the others are destroyed.
};

Mapper::Mapper(const MapperConfig& config)
    : implementation_(std::make_unique<Implementation>(config)) {}

Mapper::~Mapper() = default;

void Mapper::integrate(const Scan& scan) {
  Implementation& own = *implementation_;
  own.updater.compute(scan);  // The ray walk, which does not see the map.
  own.applying.wait();
  own.updater.swapUpdate(own.update);
  own.startApply();
}

const ScanUpdate& Mapper::walk(const Scan& scan) { return implementation_->updater.compute(scan); }

void Mapper::apply(ScanUpdate update) {
  implementation_->applying.wait();
  implementation_->update = std::move(update);
  implementation_->startApply();
}

CuboidMap& Mapper::map() {
  implementation_->is_map_given = true;
  implementation_->applying.wait();
  return implementation_->map;
}

const CuboidMap& Mapper::map() const {
  implementation_->is_map_given = true;
  implementation_->applying.wait();
  return implementation_->map;
}

const CuboidMap& Mapper::settle() {
  implementation_->applying.wait();
  return implementation_->map;
}

const ScanUpdate& Mapper::lastUpdate() const { return implementation_->update; }

}  // namespace cuboid_mapping
