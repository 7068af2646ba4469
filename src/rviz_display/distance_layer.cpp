// SPDX-License-Identifier: BSD-3-Clause
#include "distance_layer.h"

#include <rviz/properties/float_property.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace cuboid_mapping_rviz {
namespace {

using namespace cuboid_mapping;

/// Colours of distances, from red to blue.
using Palette = std::array<FlatImage::Pixel, 256>;

Palette makePalette() {
  constexpr float kBlue = 2.0F / 3.0F;
  const auto to_byte = [](float share) { return static_cast<std::uint8_t>(255.0F * share); };
  Palette palette;
  for (std::size_t i = 0; i < palette.size(); ++i) {
    Ogre::ColourValue color;
    color.setHSB(kBlue * static_cast<float>(i) / 255.0F, 1.0F, 1.0F);
    palette[i] = {to_byte(color.r), to_byte(color.g), to_byte(color.b), 255};
  }
  return palette;
}

CellBox inflate(CellBox box, std::int32_t by) {
  const Cell margin{by, by, by};
  return {box.min - margin, box.max + margin};
}

/// Bricks with other occupied voxels.
ChangeSet findChanges(const CuboidMap& before, const CuboidMap& after) {
  ChangeSet changes;
  const auto occupied_of = [](const PackedVoxels* voxels) {
    return voxels == nullptr ? BrickMask() : voxels->occupied();
  };
  after.voxels().forEach([&](const VoxelBrick& brick) {
    if (occupied_of(before.voxels().find(brick.brick)) == brick.voxels.occupied()) return;
    changes.bricks.push_back({brick.brick, true});
  });
  before.voxels().forEach([&](const VoxelBrick& brick) {
    if (after.voxels().find(brick.brick) == nullptr) changes.bricks.push_back({brick.brick, true});
  });
  return changes;
}

std::vector<FlatImage::Pixel> colorPixels(const CuboidMap& map, const DistanceField& field,
                                          double bound_m) {
  static const Palette kPalette = makePalette();
  const CellBox& layer = field.region();
  std::vector<FlatImage::Pixel> pixels;
  pixels.reserve(static_cast<std::size_t>(layer.numVoxels()));
  Cell cell = layer.min;
  for (cell.y = layer.min.y; cell.y < layer.max.y; ++cell.y) {
    for (cell.x = layer.min.x; cell.x < layer.max.x; ++cell.x) {
      if (map.voxels().at(cell) == Occupancy::kUnknown) {
        pixels.push_back({0, 0, 0, 0});
        continue;
      }
      const auto distance_m = field.distanceAt(map.grid().centerOf(CellBox::ofCell(cell)));
      const double ratio = std::min(distance_m.value_or(bound_m) / bound_m, 1.0);
      pixels.push_back(kPalette[static_cast<std::size_t>(std::lround(255.0 * ratio))]);
    }
  }
  return pixels;
}

}  // namespace

std::vector<FlatImage::Pixel> DistanceColors::update(CuboidMap map, const CellBox& layer,
                                                     double bound_m) {
  std::optional<Kept> last = std::exchange(kept_, std::nullopt);  // Dropped after an exception.
  if (last && last->field.region() == layer && last->bound_m == bound_m &&
      last->map.grid().resolution() == map.grid().resolution()) {
    last->field.update(map, findChanges(last->map, map));
    last->map = std::move(map);
    kept_ = std::move(last);
  } else {
    last.reset();
    DistanceField field(map, layer, bound_m, UnknownPolicy::kFree);
    kept_.emplace(Kept{std::move(map), std::move(field), bound_m});
  }
  return colorPixels(kept_->map, kept_->field, bound_m);
}

// NOLINTBEGIN(cppcoreguidelines-owning-memory): rviz deletes properties with their display
DistanceLayer::DistanceLayer(rviz::Display& display)
    : MapLayer(display, "Distances",
               "Show the distance to the nearest occupied voxel in one layer of voxels, from red "
               "(0) to blue (Max distance and more): 512 x 512 voxels around the viewed place."),
      height_property_(new rviz::FloatProperty(
          "Height", 0.5F, "Height of the layer in the map frame, in m.", shownProperty())),
      bound_property_(new rviz::FloatProperty(
          "Max distance", 2.0F, "Distance of the last color, in m; at most 127 voxels.",
          shownProperty())) {
  bound_property_->setMin(0.01F);
}
// NOLINTEND(cppcoreguidelines-owning-memory)

MapLayer::Job DistanceLayer::makeJob(const CuboidMap& map, const ViewRay& ray) {
  const double height_m = height_property_->getFloat();
  const double bound_m = bound_property_->getFloat();
  const double resolution_m = map.grid().resolution();
  CellBox layer = findViewedPart(map, ray, height_m);
  const std::int32_t z = layerAt(map.grid(), height_m);
  layer.min.z = std::max(layer.min.z, z);
  layer.max.z = std::min(layer.max.z, z + 1);
  const double reach = std::min(bound_m / resolution_m, DistanceField::kMaxBound);
  Job job;
  job.settings = {height_m, bound_m, resolution_m};
  job.part = layer.isEmpty() ? CellBox() : inflate(layer, static_cast<std::int32_t>(reach) + 1);
  job.compute = [=, colors = colors_](CuboidMap part, const auto& /*is_stopped*/) -> Draw {
    std::vector<FlatImage::Pixel> pixels;
    if (!layer.isEmpty()) pixels = colors->update(std::move(part), layer, bound_m);
    return [=](Ogre::SceneNode& node) {
      return draw(node, pixels, {layer, height_m, resolution_m});
    };
  };
  return job;
}

void DistanceLayer::hide() {
  image_.reset();
  colors_ = std::make_shared<DistanceColors>();
}

QString DistanceLayer::draw(Ogre::SceneNode& node, const std::vector<FlatImage::Pixel>& pixels,
                            const Place& place) {
  if (pixels.empty()) {
    hide();
    return "nothing is known at this height around the viewed place";
  }
  const Cell size = place.layer.size();
  if (image_ == nullptr) image_ = std::make_unique<FlatImage>(node);
  image_->show(pixels, static_cast<std::size_t>(size.x),
               {static_cast<float>(place.layer.min.x * place.resolution_m),
                static_cast<float>(place.layer.min.y * place.resolution_m),
                static_cast<float>(place.height_m)},
               static_cast<float>(place.resolution_m));
  return QString("%1 x %2 voxels").arg(size.x).arg(size.y);
}

}  // namespace cuboid_mapping_rviz
