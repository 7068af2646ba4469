// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_picker.h"

#include "cuboid_mapping/boxes/joined_cuboids.h"
#include "cuboid_mapping/query/value_query.h"
#include "cuboid_mapping/voxels/brick_cuboids.h"

#include <rviz/properties/float_property.h>
#include <rviz/properties/string_property.h>
#include <rviz/properties/vector_property.h>
#include <rviz/selection/selection_manager.h>

#include <OgreAxisAlignedBox.h>
#include <OgreSceneNode.h>

#include <algorithm>

namespace cuboid_mapping_rviz {

using namespace cuboid_mapping;

/// A cuboid that was picked.
struct CuboidPicker::Picture {
  std::uint64_t voxel;  ///< The first picked voxel.
  Cuboid cuboid;
  double probability;
  double resolution_m;

  [[nodiscard]] Ogre::Vector3 corner(const Cell& cell) const {
    return {static_cast<float>(cell.x * resolution_m), static_cast<float>(cell.y * resolution_m),
            static_cast<float>(cell.z * resolution_m)};
  }
  [[nodiscard]] Ogre::AxisAlignedBox box() const {
    return {corner(cuboid.box.min), corner(cuboid.box.max)};
  }
};

CuboidPicker::CuboidPicker(rviz::DisplayContext* context, const MapSource& source,
                           const Ogre::SceneNode& node, const Cell& chunk, FaceChunk& faces)
    : SelectionHandler(context), source_(source), node_(node), chunk_(chunk) {
  rviz::SelectionManager::setPickHandle(getHandle(), &faces);
  addTrackedObject(&faces);
}

/// @param voxel  Number from the shader, counted from 1; the map may have changed since.
std::optional<CuboidPicker::Picture> CuboidPicker::find(std::uint64_t voxel) const {
  if (voxel == 0 || voxel > kChunkEdge * kChunkEdge * kChunkEdge) return std::nullopt;
  const auto number = static_cast<std::int32_t>(voxel - 1);
  const Cell cell = chunk_ + Cell{number & 63, number >> 6 & 63, number >> 12};
  std::optional<Picture> picture;
  source_.read([&](const CuboidMap& map) {
    const VoxelBrick* brick = map.voxels().findBrick(brickOf(cell));
    if (brick == nullptr) return;
    std::vector<Cuboid> cuboids;
    if (are_joined_) {
      const CellBox chunk{chunk_, chunk_ + Cell{kChunkEdge, kChunkEdge, kChunkEdge}};
      cuboids = joinCuboids(map, chunk, CuboidFilter::kAll, Budget::unlimited()).value;
    } else {
      divideBrick(*brick, cuboids);
    }
    for (const Cuboid& cuboid : cuboids) {
      if (!cuboid.box.contains(cell)) continue;
      const auto probability = meanProbability(map, cuboid.box, Budget::unlimited());
      picture = Picture{voxel, cuboid, probability.valueOr(0.5), map.grid().resolution()};
    }
  });
  return picture;
}

Ogre::AxisAlignedBox CuboidPicker::boxInFixedFrame(const Picture& picture) const {
  Ogre::AxisAlignedBox box = picture.box();
  box.transform(node_._getFullTransform());
  return box;
}

std::vector<CuboidPicker::Picture> CuboidPicker::findAll(const rviz::Picked& picked) const {
  std::vector<Picture> pictures;
  for (const std::uint64_t voxel : picked.extra_handles) {
    const auto picture = find(voxel);
    const bool is_new =
        picture && std::none_of(pictures.begin(), pictures.end(), [&](const Picture& other) {
          return other.cuboid == picture->cuboid;
        });
    if (is_new) pictures.push_back(*picture);
  }
  return pictures;
}

void CuboidPicker::createProperties(const rviz::Picked& picked, rviz::Property* parent) {
  for (const Picture& picture : findAll(picked)) {
    const Ogre::AxisAlignedBox box = picture.box();
    const bool is_occupied = picture.cuboid.isOccupied();
    auto* group = new rviz::Property(is_occupied ? "Occupied cuboid" : "Free cuboid", QVariant(),
                                     "", parent);  // NOLINT: the parent deletes it
    properties_.append(group);
    const auto add = [group](auto* property) {
      property->setReadOnly(true);
      group->addChild(property);
    };
    add(new rviz::VectorProperty("Min", box.getMinimum(), "Least corner in the map frame, in m."));
    add(new rviz::VectorProperty("Max", box.getMaximum(),
                                 "Greatest corner in the map frame, in m."));
    add(new rviz::FloatProperty("Probability", static_cast<float>(picture.probability),
                                "Mean probability of its voxels of being occupied."));
    add(new rviz::FloatProperty("Volume", box.volume(), "Volume in cubic metres."));
    group->expand();
  }
}

void CuboidPicker::getAABBs(const rviz::Picked& picked, rviz::V_AABB& boxes) {
  for (const Picture& picture : findAll(picked)) boxes.push_back(boxInFixedFrame(picture));
}

void CuboidPicker::onSelect(const rviz::Picked& picked) {
  for (const Picture& picture : findAll(picked)) {
    createBox({picked.handle, picture.voxel}, boxInFixedFrame(picture), "RVIZ/Cyan");
  }
}

void CuboidPicker::onDeselect(const rviz::Picked& picked) {
  for (const std::uint64_t voxel : picked.extra_handles) destroyBox({picked.handle, voxel});
}

}  // namespace cuboid_mapping_rviz
