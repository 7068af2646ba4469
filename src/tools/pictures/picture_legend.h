// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "pictures/map_picture.h"

namespace cuboid_mapping {

/// Draws a legend into the lower left corner of a picture: colours by height, free and unknown space where they are drawn,
/// and a scale. Pictures of less than 240 x 180 pixels stay as they are.
/// @param ortho_height_m  Height of the picture in metres; 0: perspective, without a scale.
void drawLegend(Picture& picture, const PictureStyle& style, double ortho_height_m);

/// The longest round length (1, 2 or 5 times a power of ten) up to a maximum.
/// @pre max_length_m > 0.
[[nodiscard]] double roundLength(double max_length_m);

}  // namespace cuboid_mapping
