// SPDX-License-Identifier: BSD-3-Clause
// Boxes in text formats of planners and simulators.
#pragma once

#include "cuboid_mapping/geometry/grid.h"

#include <optional>
#include <string>
#include <vector>

namespace cuboid_mapping {

/// Formats of scenes of boxes.
enum class SceneFormat : unsigned char {
  kMoveit,  ///< .scene: MoveIt's planning scene as text, in the format that all its versions read.
  kCurobo,  ///< .yaml, .yml: world of cuRobo, a `cuboid:` with `dims` and `pose` for each box.
  kWorld,   ///< .world: world of Gazebo with one static model, SDF 1.6.
  kSdf,     ///< .sdf: this model alone, to be included in a world.
  kUrdf     ///< .urdf: a robot of one link, which has the name of the frame.
};

/// The format of a file name's extension, in lower or upper case; nothing for another one.
[[nodiscard]] std::optional<SceneFormat> sceneFormatOfName(const std::string& file);

/// All extensions, for messages: ".scene, .yaml, .yml, .world, .sdf, .urdf".
[[nodiscard]] std::string knownSceneEndings();

/// Boxes in a frame.
struct BoxScene {
  /// Frame of the boxes; the formats name a link, a model or the scene after it.
  std::string frame_id = "map";
  std::vector<MetricBox> boxes;  ///< Boxes, finite.
};

/// The content of a file. Boxes are called box_0, box_1, ..., but for .urdf; numbers have 12 digits.
[[nodiscard]] std::string toSceneText(const BoxScene& scene, SceneFormat format);

}  // namespace cuboid_mapping
