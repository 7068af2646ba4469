// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/map/mapper.h"

#include "cuboid_mapping/parallel/parallel_for.h"
#include "cuboid_mapping/scan/scan_update.h"

#include <new>
#include <utility>

namespace cuboid_mapping {

struct Mapper::Implementation {
  explicit Implementation(const MapperConfig& config)
      : map(checked(config).map),
        updater(map.grid(),
                BeamRanges{config.max_range_m, config.end_margin_m, config.keep_surfaces},
                config.map.threads, config.map.beamSampling()) {}

  /// Puts the update into the map; with several threads, beside the next ray walk.
  void startApply() {
    if (map.config().threads == 1) {
      map.apply(update);
      return;
    }
    is_waiting = true;
    try {
      applying = BackgroundWork([this] { apply(); });
    } catch (const std::bad_alloc&) {  // finishApply() does it.
    }
  }

  /// Waits until the update is in the map, and tries again what memory did not suffice for.
  void finishApply() {
    try {
      applying.wait();
    } catch (const std::bad_alloc&) {  // It is still waiting.
    }
    if (is_waiting) apply();
  }

  void apply() {
    map.apply(update);
    is_waiting = false;
  }

  CuboidMap map;
  ScanUpdater updater;
  ScanUpdate update;        ///< Update of the scan that goes into the map.
  bool is_waiting = false;  ///< The update is not in the map yet.
  BackgroundWork applying;  ///< Last member: it ends before the others are destroyed.
};

Mapper::Mapper(const MapperConfig& config)
    : implementation_(std::make_unique<Implementation>(config)) {}

Mapper::~Mapper() = default;

void Mapper::integrate(const Scan& scan) {
  Implementation& own = *implementation_;
  own.updater.compute(scan);  // The ray walk, which does not see the map.
  own.finishApply();
  own.updater.swapUpdate(own.update);
  own.startApply();
}

const ScanUpdate& Mapper::walk(const Scan& scan) { return implementation_->updater.compute(scan); }

void Mapper::apply(ScanUpdate update) {
  implementation_->finishApply();
  implementation_->update = std::move(update);
  implementation_->startApply();
}

CuboidMap& Mapper::map() {
  implementation_->finishApply();
  return implementation_->map;
}

const CuboidMap& Mapper::map() const {
  implementation_->finishApply();
  return implementation_->map;
}

const ScanUpdate& Mapper::lastUpdate() const { return implementation_->update; }

}  // namespace cuboid_mapping
