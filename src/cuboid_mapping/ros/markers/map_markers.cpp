// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/markers/map_markers.h"

#include "cuboid_mapping/query/height_range.h"
#include "cuboid_mapping/ros/parameters/parameter_table.h"

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

void MapMarkers::setParameters(const NodeParameters& parameters) {
  occupied_.setColorBy(parameters.color_by);
}

void MapMarkers::updateColorSpan() {
  if (!occupied_.hasListeners() || !is_span_old_) return;
  is_span_old_ = false;
  const auto span = map_.read([](const CuboidMap& map) { return findHeightRange(map); });
  if (color_span_ && !isOtherSpan(span, *color_span_)) return;
  color_span_ = span;
  occupied_.setColorSpan(span);
}

std::vector<ParameterDeclaration> MapMarkers::declare() {
  using P = NodeParameters;
  return {
      {"color_by", "",
       choice<ColorBy>(&P::color_by,
                       {{"height", ColorBy::kHeight}, {"probability", ColorBy::kProbability}}),
       "Meaning of the colour of occupied cuboids. height: from blue to red, without the lowest "
       "and "
       "the highest 2 % of the map."},
  };
}

}  // namespace cuboid_mapping_ros
