// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/scan/scan.h"

#include <limits>
#include <memory>

namespace cuboid_mapping {

/// Parameters of a Mapper.
struct MapperConfig {
  MapConfig map;  ///< Configuration of the map that the scans go into.
  /// Maximum range, at which longer beams are cut; they free the space before it. > 0.
  double max_range_m = std::numeric_limits<double>::infinity();
  /// Length before a return in which a beam frees unknown voxels only: >= 0, finite. See BeamRanges.
  double end_margin_m = 0.0;
  /// Whether beams spare the surfaces that they graze, see BeamRanges.
  bool keep_surfaces = false;
};

/// Builds a map from scans: the entry to the library.
///
/// With map.threads > 1, a scan enters the map during the ray walk of the next one; the result is the same. Not
/// thread-safe: all calls belong to one thread.
class Mapper {
 public:
  /// @throws std::invalid_argument  with everything that checkConfig() finds.
  explicit Mapper(const MapperConfig& config = {});
  Mapper(const Mapper&) = delete;
  Mapper& operator=(const Mapper&) = delete;
  /// Waits until the last scan is in the map.
  ~Mapper();

  /// Takes one scan: every voxel that its beams pass or end in is observed once, see ScanUpdate.
  /// @throws std::bad_alloc  This scan has not been taken; those before are in the map, or still enter it.
  void integrate(const Scan& scan);

  /// The two halves of integrate(): walk() here, and apply() of its result here or in another Mapper of the
  /// same configuration. See io/scan_update_codec.h.
  ///@{
  /// The voxels that a scan observes; the map stays as it is. @return Valid until the next scan.
  [[nodiscard]] const ScanUpdate& walk(const Scan& scan);
  /// Puts observations into the map. @throws std::bad_alloc  as integrate().
  void apply(ScanUpdate update);
  ///@}

  /// Waits until the last scan is in the map. @return The map with all scans, for queries (query/), edits and
  /// files (io/), until the next call of integrate() or apply(): then ask for it again.
  /// @throws std::bad_alloc  The last scan is not in the map yet: call it again.
  ///@{
  [[nodiscard]] CuboidMap& map();
  [[nodiscard]] const CuboidMap& map() const;
  ///@}

  /// Counts of the last integrate() or apply(): used points, and points that could not be used.
  [[nodiscard]] const ScanUpdate& lastUpdate() const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace cuboid_mapping
