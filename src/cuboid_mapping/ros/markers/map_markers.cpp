// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/markers/map_markers.h"

#include "cuboid_mapping/query/height_range.h"
#include "cuboid_mapping/ros/parameters/parameter_table.h"

#include <limits>

namespace cuboid_mapping_ros {

MapMarkers::MapMarkers(const MapHost& host)
    : map_(host.map),
      occupied_(host.nh, CuboidFilter::kOccupied, host.parameters, host.map),
      free_(host.nh, CuboidFilter::kFree, host.parameters, host.map),
      has_color_span_(host.parameters.color_period_m == 0.0) {}

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
  has_color_span_ = parameters.color_period_m == 0.0;
  is_span_old_ = true;
  occupied_.setColors(parameters.color_by, parameters.color_period_m);
}

void MapMarkers::updateColorSpan() {
  if (!occupied_.hasListeners() || !is_span_old_) return;
  is_span_old_ = false;
  if (!has_color_span_) {
    if (color_span_) occupied_.setColorSpan(std::nullopt);
    color_span_.reset();
    return;
  }
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
       "Meaning of the colour of occupied cuboids."},
      {"color_period", "m",
       number(&P::color_period_m, 0.0, std::numeric_limits<double>::infinity()),
       "With color_by: height, the height after which the colours repeat. 0: the colours run once, "
       "from blue to red. The lowest and the highest 2 % of the map do not count."},
      {"markers/joined", "", boolean(&P::markers_are_joined),
       "true: occupied_cuboids and free_cuboids show cuboids joined across bricks, up to 64 voxels "
       "long: walls as walls, not as tiles of 8 voxels. Reading the map for them then takes "
       "longer. Clouds wait only during this reading."},
  };
}

}  // namespace cuboid_mapping_ros
