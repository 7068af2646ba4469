// SPDX-License-Identifier: BSD-3-Clause
// Pictures of maps, drawn without a display.
#pragma once

#include "cuboid_mapping/map/cuboid_map.h"
#include "cuboid_mapping/map/progress_listener.h"
#include "cuboid_mapping/query/height_range.h"

#include <Eigen/Core>

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace cuboid_mapping {

/// Rows of red, green, blue, from the upper left corner.
struct Picture {
  std::size_t width = 0;
  std::size_t height = 0;
  std::vector<std::uint8_t> rgb;

  [[nodiscard]] std::array<std::uint8_t, 3> at(std::size_t x, std::size_t y) const {
    const std::uint8_t* pixel = &rgb[3 * (y * width + x)];
    return {pixel[0], pixel[1], pixel[2]};
  }
};

/// Viewpoint of a picture. Metres, map frame.
struct Camera {
  Eigen::Vector3d eye = Eigen::Vector3d::Zero();
  Eigen::Vector3d forward = -Eigen::Vector3d::UnitZ();  ///< Not zero.
  Eigen::Vector3d up = Eigen::Vector3d::UnitY();        ///< Not parallel to `forward`.
  double range_m = 100.0;                               ///< Nothing farther away is drawn.
  /// Height of the picture: parallel rays straight down. 0: perspective, with the angle below.
  double ortho_height_m = 0.0;
  double vertical_angle_rad = 1.0;
};

/// Size of a picture, each side from 1 to 16384.
struct PictureSize {
  std::size_t width = 1024;
  std::size_t height = 768;
};

/// A camera above the map that looks straight down and sees the whole map, +y up. @pre the map has a
/// cuboid.
[[nodiscard]] Camera makeTopCamera(const CuboidMap& map, const PictureSize& size);

/// A camera that looks at a point from another one. @pre they differ by more than 1e-6 m.
[[nodiscard]] Camera makeCameraAt(const Eigen::Vector3d& eye, const Eigen::Vector3d& target,
                                  double range_m);

/// Meaning of the colours of occupied voxels, as in the display for rviz.
enum class PictureColors : unsigned char {
  kHeight,       ///< Blue to red by height.
  kProbability,  ///< Mean of the cuboid: green at 0 to dark red at 1.
  /// Sum of the cuboid's edges: cyan (one voxel) to red (8 x 8 x 8; for joined ones the largest, on a
  /// logarithmic scale).
  kSize,
  kClass  ///< One colour for all.
};

/// Colours of pixels without an occupied voxel.
constexpr std::array<std::uint8_t, 3> kUnknownColor{255, 255, 255};
constexpr std::array<std::uint8_t, 3> kFreeColor{225, 228, 225};

/// What a cell of a picture is.
enum class PictureCells : unsigned char {
  kCuboids,  ///< Cuboids of the map.
  kJoined,   ///< Cuboids joined across bricks.
  kOctomap,  ///< Leaves of OctoMap's pruned octree of the same map.
  kVoxels    ///< Voxels.
};

class JoinedLookup;

/// Style of a picture.
struct PictureStyle {
  HeightRange heights;  ///< Heights at which the colours begin and end.
  PictureColors colors = PictureColors::kHeight;
  PictureCells cells = PictureCells::kCuboids;
  bool has_edges = false;  ///< Draws the edges of cells.
  bool has_free = true;    ///< Draws free space; false: as unknown space.
  /// For kJoined; must outlive the drawing of the picture.
  const JoinedLookup* joined = nullptr;
  int longest_edges =
      3 * kBrickEdge;       ///< Upper end of the colours by size: the greatest sum of edges.
  std::size_t samples = 1;  ///< Rays of a pixel along each side, from 1 to 4; more smooth edges.
};

/// Colour from blue at 0 over green to red at 1; values outside count as the nearest one. Each 0 to 1.
[[nodiscard]] Eigen::Vector3d heightColor(double ratio);

/// Each ray shows the first occupied voxel on it, coloured by PictureStyle and shaded by the face in view;
/// without one, kFreeColor if any voxel on the ray is free, else kUnknownColor. From above, a ray that meets no
/// occupied voxel is widened to the pixel, so that thin walls stay visible.
/// @complexity O(rays * voxels and bricks passed).
/// @param threads  >= 1; the picture does not depend on it. @param listener  Reports rows.
[[nodiscard]] Picture renderMap(const CuboidMap& map, const Camera& camera,
                                const PictureStyle& style, const PictureSize& size, int threads,
                                const ProgressListener& listener = {});

/// A picture as the bytes of a PNG file, and of a PPM file (P6).
[[nodiscard]] std::string toPng(const Picture& picture);
[[nodiscard]] std::string toPpm(const Picture& picture);

/// Whether a file's name ends in .png or .ppm.
[[nodiscard]] bool isPictureName(const std::string& file);

/// The bytes of a file in the format of its name. @pre isPictureName(file)
[[nodiscard]] std::string toPictureFile(const Picture& picture, const std::string& file);

}  // namespace cuboid_mapping
