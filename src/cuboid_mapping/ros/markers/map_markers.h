// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/mapping/map_feature.h"
#include "cuboid_mapping/ros/markers/marker_publisher.h"

#include <optional>
#include <string>

namespace cuboid_mapping_ros {

/// The topics occupied_cuboids and free_cuboids.
class MapMarkers : public MapFeature {
 public:
  explicit MapMarkers(const MapHost& host);
  [[nodiscard]] std::string name() const override { return "markers"; }
  void onChanges(const MapChanges& changes) override;
  void publish() override;

 private:
  /// Fits the colours of heights to the map if it has grown enough.
  void updateColorSpan();

  const GuardedMap& map_;
  MarkerPublisher occupied_;
  MarkerPublisher free_;
  bool is_span_old_ = true;                ///< The map has changed since the span was found.
  std::optional<HeightRange> color_span_;  ///< Current span.
};

}  // namespace cuboid_mapping_ros
