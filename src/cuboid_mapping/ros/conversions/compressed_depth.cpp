// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/conversions/compressed_depth.h"

#include <png.h>
#include <sensor_msgs/image_encodings.h>
#include <boost/algorithm/string/predicate.hpp>
#include <boost/endian/conversion.hpp>
#include <boost/make_shared.hpp>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <vector>

namespace cuboid_mapping_ros {
namespace {

namespace image_encodings = sensor_msgs::image_encodings;

constexpr std::size_t kPngSignatureBytes = 8;
constexpr std::array<const char*, 2> kTransports{"/compressedDepth", "/compressed"};

/// Header that compressed_depth_image_transport writes before the PNG.
struct DepthHeader {
  std::int32_t format;
  float quant_a;  ///< A number n > 0 of the PNG is a depth of quant_a / (n - quant_b) metres.
  float quant_b;
};
static_assert(sizeof(DepthHeader) == 12, "as on the wire");

/// Pixels in the byte order of this machine.
struct Pixels {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::vector<std::uint16_t> numbers;
};

/// @throws std::runtime_error with the defect.
Pixels readPng(const std::uint8_t* data, std::size_t size) {
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  const auto check = [&png](int is_good) {
    if (is_good != 0) return;
    throw std::runtime_error(std::string("its PNG is damaged (") + png.message +
                             "). Look for a driver or a relay that truncates it");
  };
  check(png_image_begin_read_from_memory(&png, data, size));
  if (png.format != PNG_FORMAT_LINEAR_Y) {
    png_image_free(&png);
    throw std::runtime_error("its PNG is not of 16 bits of grey. Connect the topic of depths");
  }
  Pixels pixels{png.width, png.height, {}};
  pixels.numbers.resize(std::size_t{png.width} * png.height);
  check(png_image_finish_read(&png, nullptr, pixels.numbers.data(), 0, nullptr));
  return pixels;
}

std::vector<float> toDepths(const Pixels& pixels, const DepthHeader& header) {
  std::vector<float> depths_m;
  depths_m.reserve(pixels.numbers.size());
  for (const std::uint16_t number : pixels.numbers) {
    depths_m.push_back(number == 0
                           ? std::numeric_limits<float>::quiet_NaN()
                           : header.quant_a / (static_cast<float>(number) - header.quant_b));
  }
  return depths_m;
}

template <typename NumberT>
sensor_msgs::Image::ConstPtr makeImage(const sensor_msgs::Image& compressed, const Pixels& pixels,
                                       const std::vector<NumberT>& numbers,
                                       const std::string& encoding) {
  const auto image = boost::make_shared<sensor_msgs::Image>();
  image->header = compressed.header;
  image->width = pixels.width;
  image->height = pixels.height;
  image->encoding = encoding;
  image->is_bigendian = boost::endian::order::native == boost::endian::order::big;
  image->step = pixels.width * sizeof(NumberT);
  image->data.resize(numbers.size() * sizeof(NumberT));
  std::memcpy(image->data.data(), numbers.data(), image->data.size());
  return image;
}

/// @throws std::runtime_error with the defect.
sensor_msgs::Image::ConstPtr decode(const sensor_msgs::Image& compressed) {
  const std::string& format = compressed.encoding;
  const std::string encoding = format.substr(0, format.find(';'));
  if (format.find("rvl") != std::string::npos || format.find("jp") != std::string::npos) {
    throw std::runtime_error("it is compressed as '" + format +
                             "'. Set the format of its image_transport to png");
  }
  const std::vector<std::uint8_t>& data = compressed.data;
  if (data.size() < sizeof(DepthHeader)) {
    throw std::runtime_error("it has no data. Look for a driver or a relay that truncates it");
  }
  // Not the format, but the data says whether there is a header.
  const bool has_header = png_sig_cmp(data.data(), 0, kPngSignatureBytes) != 0;
  const std::size_t first = has_header ? sizeof(DepthHeader) : 0;
  const Pixels pixels = readPng(data.data() + first, data.size() - first);
  DepthHeader header{};
  if (has_header) std::memcpy(&header, data.data(), sizeof(header));
  const bool has_metres = encoding.empty() ? header.quant_a > 0.0F && std::isnormal(header.quant_a)
                                           : encoding == image_encodings::TYPE_32FC1;
  if (!has_metres) {
    return makeImage(compressed, pixels, pixels.numbers,
                     encoding.empty() ? image_encodings::TYPE_16UC1 : encoding);
  }
  if (!has_header) throw std::runtime_error("metres do not fit into PNG. Use compressedDepth");
  return makeImage(compressed, pixels, toDepths(pixels, header), image_encodings::TYPE_32FC1);
}

}  // namespace

std::string withoutTransport(const std::string& topic) {
  for (const std::string transport : kTransports) {
    if (topic.size() > transport.size() && boost::algorithm::ends_with(topic, transport)) {
      return topic.substr(0, topic.size() - transport.size());
    }
  }
  return topic;
}

bool isCompressed(const std::string& topic) { return withoutTransport(topic) != topic; }

sensor_msgs::Image::ConstPtr toCompressedImage(const sensor_msgs::CompressedImage& message) {
  const auto image = boost::make_shared<sensor_msgs::Image>();
  image->header = message.header;
  image->encoding =
      message.format.find(';') == std::string::npos ? "; " + message.format : message.format;
  image->data = message.data;
  return image;
}

bool isCompressed(const sensor_msgs::Image& image) {
  return image.encoding.find(';') != std::string::npos;
}

std::variant<sensor_msgs::Image::ConstPtr, std::string> decompress(
    const sensor_msgs::Image& compressed) {
  try {
    return decode(compressed);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
}

}  // namespace cuboid_mapping_ros
