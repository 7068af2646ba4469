// SPDX-License-Identifier: BSD-3-Clause
#include "wire_boxes.h"

namespace cuboid_mapping_rviz {

void WireBoxes::show(const std::vector<cuboid_mapping::Box>& boxes) {
  edges_.clear();
  if (boxes.empty()) return;
  edges_.begin("BaseWhiteNoLighting", Ogre::RenderOperation::OT_LINE_LIST);
  for (const cuboid_mapping::Box& box : boxes) {
    const auto add_corner = [&](int corner) {
      edges_.position(static_cast<float>((corner & 1) != 0 ? box.max.x : box.min.x),
                      static_cast<float>((corner & 2) != 0 ? box.max.y : box.min.y),
                      static_cast<float>((corner & 4) != 0 ? box.max.z : box.min.z));
      edges_.colour(color_);
    };
    for (int corner = 0; corner < 8; ++corner) {
      for (const int axis : {1, 2, 4}) {
        if ((corner & axis) != 0) continue;
        add_corner(corner);
        add_corner(corner | axis);
      }
    }
  }
  edges_.end();
}

}  // namespace cuboid_mapping_rviz
