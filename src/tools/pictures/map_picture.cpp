// SPDX-License-Identifier: BSD-3-Clause
#include "pictures/map_picture.h"

#include "pictures/picture_cells.h"

#include "cuboid_mapping/map/cuboid_search.h"
#include "cuboid_mapping/parallel/parallel_for.h"
#include "cuboid_mapping/query/point_query.h"
#include "cuboid_mapping/query/ray_query.h"
#include "cuboid_mapping/query/value_query.h"

#include <Eigen/Geometry>

#include <png.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <mutex>
#include <optional>
#include <stdexcept>

namespace cuboid_mapping {
namespace {

using Rgb = std::array<std::uint8_t, 3>;

std::optional<CellBox> findExtent(const CuboidMap& map, CuboidFilter filter) {
  std::optional<CellBox> extent;
  visitAll(map, filter, [&extent](const Cuboid& cuboid) {
    extent = extent ? unite(*extent, cuboid.box) : cuboid.box;
    return Visit::kContinue;
  });
  return extent;
}

/// Light from above and a little from the front, by the axis of the face with a point.
double shadeOf(const CuboidMap& map, const Cell& voxel, const Eigen::Vector3d& point_map) {
  const MetricBox box = map.grid().toMetricBox(CellBox::ofCell(voxel));
  const Eigen::Array3d to_face =
      (point_map - box.min_m).array().abs().min((box.max_m - point_map).array().abs());
  Eigen::Index axis = 0;
  to_face.minCoeff(&axis);
  constexpr std::array<double, 3> kShades{0.65, 0.8, 1.0};
  return kShades[static_cast<std::size_t>(axis)];
}

/// Colour on the circle of hues, from red at 0.
Eigen::Vector3d rainbow(double ratio) {
  const auto share = [ratio](double shift) {
    return std::clamp(std::abs(std::fmod(4.0 * ratio + shift, 6.0) - 3.0) - 1.0, 0.0, 1.0);
  };
  return {share(0.0), share(4.0), share(2.0)};
}

/// Edges of a cuboid relative to the longest.
double sizeRatio(const Cell& edges, const PictureStyle& style) {
  const double sum = edges.x + edges.y + edges.z;
  if (style.cells != PictureCells::kJoined) return sum / style.longest_edges;
  return std::log(sum / 3.0) / std::log(std::max(4, style.longest_edges) / 3.0);
}

/// The colour of an occupied voxel before shading, as in the display for rviz.
Eigen::Vector3d ownColor(const CuboidMap& map, const RayQueryResult& seen,
                         const PictureStyle& style) {
  const HeightRange& heights = style.heights;
  if (style.colors == PictureColors::kHeight) {
    return heightColor((seen.point_map.z() - heights.min_m) / (heights.max_m - heights.min_m));
  }
  if (style.colors == PictureColors::kClass) return {0.30, 0.55, 0.90};
  const CellBox cell = findCell(map, *seen.voxel, style);
  if (style.colors == PictureColors::kSize) {
    return rainbow(0.8 * (1.0 - std::min(1.0, sizeRatio(cell.size(), style))));
  }
  const double probability = meanProbability(map, cell, Budget::unlimited()).valueOr(0.5);
  return Eigen::Vector3d(0.1, 0.7, 0.2) * (1.0 - probability) +
         Eigen::Vector3d(0.85, 0.1, 0.1) * probability;
}

/// @param pixel_m  Edge of a pixel at the distance of what was seen.
Rgb colorOf(const CuboidMap& map, const RayQueryResult& seen, const PictureStyle& style,
            double range_m, double pixel_m) {
  if (seen.end != RayEnd::kOccupied || !seen.voxel) {
    const bool is_free = style.has_free && seen.unknown_length_m < range_m * (1.0 - 1e-9);
    return is_free ? kFreeColor : kUnknownColor;
  }
  Eigen::Vector3d color = ownColor(map, seen, style) * shadeOf(map, *seen.voxel, seen.point_map);
  if (style.has_edges) {
    color = color * 0.75 + Eigen::Vector3d::Constant(0.25);  // Dark lines show on bright faces.
    const MetricBox cell = map.grid().toMetricBox(findCell(map, *seen.voxel, style));
    color *= 1.0 - 0.8 * edgeDarkness(cell, seen.point_map, pixel_m);
  }
  Rgb rgb{};
  for (std::size_t i = 0; i < 3; ++i) {
    rgb[i] = static_cast<std::uint8_t>(std::lround(255.0 * color[static_cast<Eigen::Index>(i)]));
  }
  return rgb;
}

/// The mean colour of the parts of a pixel. @param color_of  (x, y) of a part -> its colour.
template <typename ColorOfT>
Rgb averageColor(std::size_t samples, ColorOfT color_of) {
  std::array<std::size_t, 3> sums{};
  for (std::size_t y = 0; y < samples; ++y) {
    for (std::size_t x = 0; x < samples; ++x) {
      const Rgb color = color_of(x, y);
      for (std::size_t i = 0; i < 3; ++i) sums[i] += color[i];
    }
  }
  const std::size_t count = samples * samples;
  Rgb mean{};
  for (std::size_t i = 0; i < 3; ++i) {
    mean[i] = static_cast<std::uint8_t>((sums[i] + count / 2) / count);
  }
  return mean;
}

struct PixelRay {
  Eigen::Vector3d origin;
  Eigen::Vector3d direction;
};

/// The highest occupied voxel below a pixel, on a ray straight down; nothing if there is none.
/// @param edge_m  Edge of the pixel.
std::optional<RayQueryResult> seeBelow(const CuboidMap& map, const Eigen::Vector3d& center,
                                       double edge_m, double range_m) {
  const Eigen::Vector3d half(0.5 * edge_m, 0.5 * edge_m, 0.0);
  const auto column =
      map.grid().toCellBox({center - half - Eigen::Vector3d(0.0, 0.0, range_m), center + half});
  if (!column) return std::nullopt;
  std::optional<Cell> highest;
  visitBox(map, *column, CuboidFilter::kOccupied, [&](const Cuboid& cuboid) {
    const Cell top = intersect(cuboid.box, *column).max - Cell{1, 1, 1};
    if (!highest || top.z > highest->z) highest = top;
    return Visit::kContinue;
  });
  if (!highest) return std::nullopt;
  const MetricBox box = map.grid().toMetricBox(CellBox::ofCell(*highest));
  RayQueryResult seen;
  seen.end = RayEnd::kOccupied;
  seen.voxel = highest;
  seen.point_map = 0.5 * (box.min_m + box.max_m);
  seen.point_map.z() = box.max_m.z();
  return seen;
}

/// The surface in a pixel.
std::optional<RayQueryResult> see(const CuboidMap& map, const Camera& camera, const PixelRay& ray,
                                  double pixel_m) {
  const auto seen = castRay(map, ray.origin, ray.direction, camera.range_m, UnknownPolicy::kFree,
                            Budget::unlimited());
  if (!seen.isFound()) return std::nullopt;
  const bool is_large = pixel_m > map.grid().resolution();
  if (is_large && seen->end != RayEnd::kOccupied) {
    if (auto below = seeBelow(map, ray.origin, pixel_m, camera.range_m)) return below;
  }
  return *seen;
}

/// Rays through pixels, or through the parts of pixels.
class Lens {
 public:
  /// @param size  Of the picture in rays.
  Lens(const Camera& camera, const PictureSize& size)
      : camera_(camera),
        size_(size),
        forward_(camera.forward.normalized()),
        right_(forward_.cross(camera.up).normalized()),
        up_(right_.cross(forward_)) {}

  [[nodiscard]] PixelRay rayOf(std::size_t x, std::size_t y) const {
    const auto height = static_cast<double>(size_.height);
    // In units of the picture's height, from its centre.
    const double to_right =
        (static_cast<double>(x) + 0.5) / height - 0.5 * static_cast<double>(size_.width) / height;
    const double to_top = 0.5 - (static_cast<double>(y) + 0.5) / height;
    if (camera_.ortho_height_m > 0.0) {
      return {camera_.eye + camera_.ortho_height_m * (to_right * right_ + to_top * up_), forward_};
    }
    return {camera_.eye, forward_ + scale() * (to_right * right_ + to_top * up_)};
  }

  /// Height of the picture at the distance of a point. Metres.
  [[nodiscard]] double heightAt(const Eigen::Vector3d& point_map) const {
    if (camera_.ortho_height_m > 0.0) return camera_.ortho_height_m;
    return scale() * std::max(0.0, forward_.dot(point_map - camera_.eye));
  }

 private:
  [[nodiscard]] double scale() const { return 2.0 * std::tan(0.5 * camera_.vertical_angle_rad); }

  Camera camera_;
  PictureSize size_;
  Eigen::Vector3d forward_;
  Eigen::Vector3d right_;
  Eigen::Vector3d up_;
};

}  // namespace

Camera makeTopCamera(const CuboidMap& map, const PictureSize& size) {
  const MetricBox box =
      map.grid().toMetricBox(findExtent(map, CuboidFilter::kAll).value_or(CellBox{}));
  const Eigen::Vector3d extent_m = box.max_m - box.min_m;
  constexpr double kMargin = 1.05;
  Camera camera;
  camera.eye = 0.5 * (box.min_m + box.max_m);
  camera.eye.z() = box.max_m.z() + map.grid().resolution();
  camera.range_m = extent_m.z() + 2.0 * map.grid().resolution();
  camera.ortho_height_m =
      kMargin * std::max(extent_m.y(), extent_m.x() * static_cast<double>(size.height) /
                                           static_cast<double>(size.width));
  return camera;
}

Camera makeCameraAt(const Eigen::Vector3d& eye, const Eigen::Vector3d& target, double range_m) {
  Camera camera;
  camera.eye = eye;
  camera.forward = target - eye;
  camera.range_m = range_m;
  const bool is_vertical = camera.forward.head<2>().norm() < 1e-6;
  camera.up = is_vertical ? Eigen::Vector3d::UnitY() : Eigen::Vector3d::UnitZ();
  return camera;
}

Eigen::Vector3d heightColor(double ratio) {
  const double t = std::clamp(ratio, 0.0, 1.0);
  const auto share = [t](double center) {
    return std::clamp(1.5 - 4.0 * std::abs(t - center), 0.0, 1.0);
  };
  return {share(0.85), share(0.5), share(0.15)};
}

Picture renderMap(const CuboidMap& map, const Camera& camera, const PictureStyle& style,
                  const PictureSize& size, int threads, const ProgressListener& listener) {
  Picture picture{size.width, size.height,
                  std::vector<std::uint8_t>(3 * size.width * size.height, 255)};
  const Lens lens(camera, {style.samples * size.width, style.samples * size.height});
  const auto draw_ray = [&](std::size_t x, std::size_t y) {
    const PixelRay ray = lens.rayOf(x, y);
    const auto height = static_cast<double>(size.height);
    const auto seen = see(map, camera, ray, camera.ortho_height_m / height);
    if (!seen) return kUnknownColor;
    return colorOf(map, *seen, style, camera.range_m, lens.heightAt(seen->point_map) / height);
  };
  std::mutex mutex;
  std::uint64_t num_rows = 0;
  if (listener) listener(0, size.height);
  parallelFor(size.height, threads, [&](std::size_t y) {
    for (std::size_t x = 0; x < size.width; ++x) {
      const Rgb color = averageColor(style.samples, [&](std::size_t part_x, std::size_t part_y) {
        return draw_ray(style.samples * x + part_x, style.samples * y + part_y);
      });
      std::copy(color.begin(), color.end(), &picture.rgb[3 * (y * size.width + x)]);
    }
    const std::lock_guard<std::mutex> lock(mutex);
    ++num_rows;
    if (listener) listener(num_rows, size.height);
  });
  return picture;
}

std::string toPng(const Picture& picture) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(picture.width);
  image.height = static_cast<png_uint_32>(picture.height);
  image.format = PNG_FORMAT_RGB;
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
  std::string bytes(size, '\0');
  if (png_image_write_to_memory(&image, bytes.data(), &size, 0, picture.rgb.data(), 0, nullptr) ==
      0) {
    throw std::runtime_error(std::string("cannot make a PNG: ") + image.message);
  }
  bytes.resize(size);
  return bytes;
}

std::string toPpm(const Picture& picture) {
  std::string bytes =
      "P6\n" + std::to_string(picture.width) + ' ' + std::to_string(picture.height) + "\n255\n";
  return bytes.append(picture.rgb.begin(), picture.rgb.end());
}

bool isPictureName(const std::string& file) {
  const std::string ending = std::filesystem::path(file).extension().string();
  return ending == ".png" || ending == ".ppm";
}

std::string toPictureFile(const Picture& picture, const std::string& file) {
  const bool is_ppm = std::filesystem::path(file).extension() == ".ppm";
  return is_ppm ? toPpm(picture) : toPng(picture);
}

}  // namespace cuboid_mapping
