// SPDX-License-Identifier: BSD-3-Clause
#include "pictures/picture_legend.h"

#include "cuboid_mapping/io/text.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <string_view>
#include <vector>

namespace cuboid_mapping {
namespace {

using Rgb = std::array<std::uint8_t, 3>;

constexpr Rgb kInk{20, 20, 20};
constexpr Rgb kPaper{255, 255, 255};
constexpr std::size_t kMinWidth = 240;
constexpr std::size_t kMinHeight = 180;
constexpr int kPixel = 2;  ///< Edge of a dot of a letter.
constexpr int kTextHeight = 5 * kPixel;
constexpr int kMargin = 8;
constexpr int kBarWidth = 14;
constexpr int kBarHeight = 96;
constexpr int kBoxWidth = 112;
constexpr int kKeyHeight = kTextHeight + 6;  ///< A colour with its name.

/// A letter of 3 x 5 dots: rows from above, the left dot in bit 2.
struct Glyph {
  char letter;
  std::array<std::uint8_t, 5> rows;
};

constexpr std::array<Glyph, 21> kGlyphs{
    {{'0', {7, 5, 5, 5, 7}}, {'1', {2, 6, 2, 2, 7}}, {'2', {7, 1, 7, 4, 7}}, {'3', {7, 1, 7, 1, 7}},
     {'4', {5, 5, 7, 1, 1}}, {'5', {7, 4, 7, 1, 7}}, {'6', {7, 4, 7, 5, 7}}, {'7', {7, 1, 1, 2, 2}},
     {'8', {7, 5, 7, 5, 7}}, {'9', {7, 5, 7, 1, 7}}, {'.', {0, 0, 0, 0, 2}}, {'-', {0, 0, 7, 0, 0}},
     {'m', {0, 0, 7, 7, 5}}, {'e', {0, 7, 5, 6, 7}}, {'f', {3, 2, 7, 2, 2}}, {'k', {4, 5, 6, 5, 5}},
     {'n', {0, 0, 6, 5, 5}}, {'o', {0, 0, 7, 5, 7}}, {'r', {0, 0, 7, 4, 4}}, {'u', {0, 0, 5, 5, 7}},
     {'w', {0, 0, 5, 7, 7}}}};

/// Draws with y upwards from the lower left corner.
class Pen {
 public:
  explicit Pen(Picture& picture) : picture_(picture) {}

  void fill(int left, int bottom, int width, int height, const Rgb& color) {
    for (int y = bottom; y < bottom + height; ++y) {
      for (int x = left; x < left + width; ++x) set(x, y, color);
    }
  }

  void write(int left, int bottom, std::string_view text) {
    for (const char letter : text) {
      const auto* glyph = std::find_if(kGlyphs.begin(), kGlyphs.end(),
                                       [letter](const Glyph& g) { return g.letter == letter; });
      if (glyph != kGlyphs.end()) writeGlyph(left, bottom, *glyph);
      left += 4 * kPixel;
    }
  }

 private:
  void writeGlyph(int left, int bottom, const Glyph& glyph) {
    for (int row = 0; row < 5; ++row) {
      for (int column = 0; column < 3; ++column) {
        if ((glyph.rows[static_cast<std::size_t>(row)] >> (2 - column) & 1) == 0) continue;
        fill(left + column * kPixel, bottom + (4 - row) * kPixel, kPixel, kPixel, kInk);
      }
    }
  }

  void set(int x, int y, const Rgb& color) {
    const auto column = static_cast<std::size_t>(x);
    const auto row = picture_.height - 1 - static_cast<std::size_t>(y);
    if (column >= picture_.width || row >= picture_.height) return;
    std::copy(color.begin(), color.end(), &picture_.rgb[3 * (row * picture_.width + column)]);
  }

  Picture& picture_;
};

/// A length, to the centimetre if the range of lengths is short, else to the decimetre.
std::string lengthText(double length_m, double range_m) {
  const double steps_per_m = range_m < 1.0 ? 100.0 : 10.0;
  return toText(std::round(length_m * steps_per_m) / steps_per_m + 0.0) + " m";  // + 0.0: no "-0"
}

/// Names the colours from the lowest to the highest; labels that would repeat another one are left out.
void drawColors(Pen& pen, const HeightRange& heights, int bottom) {
  for (int y = 0; y < kBarHeight; ++y) {
    const Eigen::Vector3d color = heightColor((y + 0.5) / kBarHeight) * 255.0;
    pen.fill(2 * kMargin, bottom + y, kBarWidth, 1,
             {static_cast<std::uint8_t>(color.x()), static_cast<std::uint8_t>(color.y()),
              static_cast<std::uint8_t>(color.z())});
  }
  const int left = 2 * kMargin + kBarWidth + 6;
  const int top = bottom + kBarHeight - kTextHeight;
  const double range_m = heights.max_m - heights.min_m;
  const std::string lowest = lengthText(heights.min_m, range_m);
  const std::string middle = lengthText(heights.min_m + 0.5 * range_m, range_m);
  const std::string highest = lengthText(heights.max_m, range_m);
  pen.write(left, bottom, lowest);
  if (middle != lowest && middle != highest) pen.write(left, (bottom + top) / 2, middle);
  if (highest != lowest) pen.write(left, top, highest);
}

/// A colour of the picture that has a name.
struct Key {
  Rgb color;
  const char* name;
};

/// Which of free and unknown space the picture shows, from below.
std::vector<Key> findKeys(const Picture& picture) {
  std::vector<Key> keys;
  for (const Key& key : {Key{kUnknownColor, "unknown"}, Key{kFreeColor, "free"}}) {
    for (std::size_t i = 0; i < picture.rgb.size(); i += 3) {
      if (!std::equal(key.color.begin(), key.color.end(), &picture.rgb[i])) continue;
      keys.push_back(key);
      break;
    }
  }
  return keys;
}

void drawKeys(Pen& pen, const std::vector<Key>& keys, int bottom) {
  for (const Key& key : keys) {
    pen.fill(2 * kMargin, bottom, kBarWidth, kTextHeight, kInk);
    pen.fill(2 * kMargin + 1, bottom + 1, kBarWidth - 2, kTextHeight - 2, key.color);
    pen.write(2 * kMargin + kBarWidth + 6, bottom, key.name);
    bottom += kKeyHeight;
  }
}

void drawScale(Pen& pen, double pixels_per_m) {
  constexpr double kMaxWidth = kBoxWidth - 2 * kMargin;
  const double length_m = roundLength(kMaxWidth / pixels_per_m);
  const int width = std::max(1, static_cast<int>(std::lround(length_m * pixels_per_m)));
  pen.fill(2 * kMargin, 2 * kMargin, width, 3, kInk);
  pen.write(2 * kMargin, 2 * kMargin + 6, lengthText(length_m, length_m));
}

}  // namespace

double roundLength(double max_length_m) {
  const double power = std::pow(10.0, std::floor(std::log10(max_length_m)));
  for (const double factor : {5.0, 2.0}) {
    if (factor * power <= max_length_m) return factor * power;
  }
  return power;
}

void drawLegend(Picture& picture, const PictureStyle& style, double ortho_height_m) {
  if (picture.width < kMinWidth || picture.height < kMinHeight) return;
  const bool has_scale = ortho_height_m > 0.0;
  const bool has_colors = style.colors == PictureColors::kHeight;
  const std::vector<Key> keys = findKeys(picture);
  if (!has_scale && !has_colors && keys.empty()) return;
  const int bottom_of_keys = has_scale ? 2 * kMargin + kTextHeight + 12 : 2 * kMargin;
  const int bottom_of_colors = bottom_of_keys + kKeyHeight * static_cast<int>(keys.size());
  Pen pen(picture);
  pen.fill(kMargin, kMargin, kBoxWidth, bottom_of_colors + (has_colors ? kBarHeight : 0), kPaper);
  drawKeys(pen, keys, bottom_of_keys);
  if (has_colors) drawColors(pen, style.heights, bottom_of_colors);
  if (has_scale) drawScale(pen, static_cast<double>(picture.height) / ortho_height_m);
}

}  // namespace cuboid_mapping
