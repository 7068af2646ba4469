// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "map_picture.h"

namespace cuboid_mapping {

/// Draws a legend of the colours, if by height, and a scale into the lower left corner of a picture. Pictures of
/// less than 240 x 180 pixels stay as they are.
/// @param ortho_height_m  Height of the picture in metres; 0: in perspective there is no scale.
void drawLegend(Picture& picture, const PictureStyle& style, double ortho_height_m);

/// The longest round length (1, 2 or 5 times a power of ten) that is not longer than another one.
/// @pre max_length_m > 0.
[[nodiscard]] double roundLength(double max_length_m);

}  // namespace cuboid_mapping
