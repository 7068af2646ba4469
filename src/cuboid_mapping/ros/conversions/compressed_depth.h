// SPDX-License-Identifier: BSD-3-Clause
// Depth images in image_transport's formats "compressedDepth" and "compressed". This is own code because
// image_transport loads its decoders as plugins of subscribers: Debian has none of them, and a bag has no
// subscriber.
#pragma once

#include <sensor_msgs/CompressedImage.h>
#include <sensor_msgs/Image.h>

#include <string>
#include <variant>

namespace cuboid_mapping_ros {

/// The name of an image's topic without the name of a compressed transport: "/camera/depth" for
/// "/camera/depth/compressedDepth".
[[nodiscard]] std::string withoutTransport(const std::string& topic);

/// Whether messages on this topic are sensor_msgs/CompressedImage, by its name.
[[nodiscard]] bool isCompressed(const std::string& topic);

/// Wraps a message as an image whose data is still compressed: without a size, and with the message's `format`
/// as encoding, behind "; " if it has no semicolon.
[[nodiscard]] sensor_msgs::Image::ConstPtr toCompressedImage(
    const sensor_msgs::CompressedImage& message);

/// Whether the data of an image is compressed, by its encoding.
[[nodiscard]] bool isCompressed(const sensor_msgs::Image& image);

/// Decodes an image of toCompressedImage().
///
/// Cases:
///   - "16UC1; compressedDepth", "... png" and "16UC1; png compressed": the same numbers as before compression;
///   - "32FC1; compressedDepth": metres; compressed_depth_image_transport quantizes the inverse of the depth. 0
///     becomes NaN;
///   - a format without an encoding, such as "png": 16UC1, or 32FC1 if the header has its quantization;
///   - RVL, JPEG, PNG of other than 16 bits of grey, and damaged data: refused.
///
/// @return The image, in the byte order of this machine; or the defect and its cure. @complexity O(pixels).
[[nodiscard]] std::variant<sensor_msgs::Image::ConstPtr, std::string> decompress(
    const sensor_msgs::Image& compressed);

}  // namespace cuboid_mapping_ros
