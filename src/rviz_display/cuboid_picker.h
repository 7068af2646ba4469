// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "face_chunk.h"
#include "map_source.h"

#include <rviz/selection/selection_handler.h>

#include <optional>
#include <vector>

namespace cuboid_mapping_rviz {

/// Finds the picked cuboids of a chunk for rviz: a second rendering pass draws the number of each voxel as a
/// colour.
class CuboidPicker : public rviz::SelectionHandler {
 public:
  /// @param node  Node in the map frame. It, the source and the chunk must outlive this object.
  CuboidPicker(rviz::DisplayContext* context, const MapSource& source, const Ogre::SceneNode& node,
               const cuboid_mapping::Cell& chunk, FaceChunk& faces);

  /// Sets whether joined cuboids of the chunk are picked, as they are drawn.
  void setJoined(bool are_joined) { are_joined_ = are_joined; }

  bool needsAdditionalRenderPass(std::uint32_t pass) override { return pass == 1; }
  void createProperties(const rviz::Picked& picked, rviz::Property* parent) override;
  void getAABBs(const rviz::Picked& picked, rviz::V_AABB& boxes) override;
  void onSelect(const rviz::Picked& picked) override;
  void onDeselect(const rviz::Picked& picked) override;

 private:
  struct Picture;

  [[nodiscard]] std::optional<Picture> find(std::uint64_t voxel) const;
  /// The cuboids of all picked voxels, each once.
  [[nodiscard]] std::vector<Picture> findAll(const rviz::Picked& picked) const;

  [[nodiscard]] Ogre::AxisAlignedBox boxInFixedFrame(const Picture& picture) const;

  const MapSource& source_;
  const Ogre::SceneNode& node_;
  cuboid_mapping::Cell chunk_;
  bool are_joined_ = false;
};

}  // namespace cuboid_mapping_rviz
