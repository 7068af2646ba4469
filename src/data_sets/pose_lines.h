// SPDX-License-Identifier: BSD-3-Clause
// Files with numbers in lines, such as poses.txt.
#pragma once

#include <Eigen/Geometry>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace cuboid_mapping {

/// A line of poses.txt.
constexpr char kIndexedPose[] = "index tx ty tz qx qy qz qw";

/// Removes the mark that editors of Windows put before the first line of a text.
inline void dropByteOrderMark(std::string& line) {
  if (line.rfind("\xEF\xBB\xBF", 0) == 0) line.erase(0, 3);
}

/// Numbers of each line of a file; comments and empty lines are left out.
/// @param take  Gets the numbers of a line; returns false if they are not as expected.
template <typename TakeT>
void readLines(const std::filesystem::path& file, const std::string& expected, const TakeT& take) {
  std::ifstream in(file);
  if (!in) throw std::runtime_error("cannot open " + file.string());
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    if (number == 1) dropByteOrderMark(line);
    const std::size_t first = line.find_first_not_of(" \t\r");
    if (first == std::string::npos || line[first] == '#') continue;
    std::istringstream words(line);
    const std::vector<double> numbers{std::istream_iterator<double>(words), {}};
    if (!words.eof() || !take(numbers)) {
      throw std::runtime_error(file.string() + ":" + std::to_string(number) + ": expected '" +
                               expected + "'");
    }
  }
}

/// A pose of the 12 numbers of a 3 x 4 matrix, row by row, or of the 8 of kIndexedPose; else nothing.
[[nodiscard]] inline std::optional<Eigen::Isometry3d> toPose(const std::vector<double>& numbers) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  if (numbers.size() == 12) {
    pose.matrix().topRows<3>() =
        Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(numbers.data());
    // Poses are written with six digits. A matrix of zeros is that of a lost pose; one that mirrors comes from programs
    // with left-handed frames.
    if (!(pose.linear() * pose.linear().transpose()).isIdentity(0.01)) return std::nullopt;
    if (pose.linear().determinant() < 0.0) return std::nullopt;
    pose.linear() = Eigen::Quaterniond(pose.linear()).normalized().toRotationMatrix();
    return pose;
  }
  if (numbers.size() != 8) return std::nullopt;
  const Eigen::Quaterniond q(numbers[7], numbers[4], numbers[5], numbers[6]);
  if (!(q.norm() > 0.5)) return std::nullopt;
  pose = Eigen::Translation3d(numbers[1], numbers[2], numbers[3]) * q.normalized();
  return pose;
}

}  // namespace cuboid_mapping
