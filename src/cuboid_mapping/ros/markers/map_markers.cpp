// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/markers/map_markers.h"

#include "cuboid_mapping/query/height_range.h"

namespace cuboid_mapping_ros {

MapMarkers::MapMarkers(const MapHost& host)
    : map_(host.map),
      occupied_(host.nh, CuboidFilter::kOccupied, host.parameters, host.map),
      free_(host.nh, CuboidFilter::kFree, host.parameters, host.map) {}

void MapMarkers::onChanges(const MapChanges& changes) {
  if (changes.changed.is_everything || !changes.changed.bricks.empty()) is_span_old_ = true;
  occupied_.noteChanges(changes.changed);
  free_.noteChanges(changes.changed);
}

void MapMarkers::publish() {
  updateColorSpan();
  occupied_.publish();
  free_.publish();
}

void MapMarkers::updateColorSpan() {
  if (!occupied_.hasListeners() || !is_span_old_) return;
  is_span_old_ = false;
  const auto span = map_.read([](const CuboidMap& map) { return findHeightRange(map); });
  if (color_span_ && !isOtherSpan(span, *color_span_)) return;
  color_span_ = span;
  occupied_.setColorSpan(span);
}

}  // namespace cuboid_mapping_ros
