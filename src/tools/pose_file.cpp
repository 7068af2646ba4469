// SPDX-License-Identifier: BSD-3-Clause
#include "pose_file.h"

#include "cuboid_mapping/io/file_replacement.h"
#include "cuboid_mapping/io/text.h"

#include <array>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <sstream>

namespace cuboid_mapping {
namespace {

/// Bound of stamps: 292 years.
constexpr double kMaxStamp_s = 9e9;

std::optional<double> toNumber(const std::string& word) {
  std::istringstream in(word);
  in.imbue(std::locale::classic());
  double number = 0.0;
  if (!(in >> number) || !in.eof() || !std::isfinite(number)) return std::nullopt;
  return number;
}

/// Parses the decimals apart: a double of today's stamps has steps of 240 ns.
std::optional<std::int64_t> toNanoseconds(const std::string& word) {
  const auto seconds = toNumber(word);
  if (!seconds || std::abs(*seconds) > kMaxStamp_s) return std::nullopt;
  const std::size_t point = word.find('.');
  if (point == std::string::npos || word.find_first_not_of("0123456789.") != std::string::npos) {
    return std::llround(*seconds * 1e9);
  }
  std::string decimals = word.substr(point + 1, 9);
  decimals.resize(9, '0');
  return std::atoll(word.substr(0, point).c_str()) * 1000000000 + std::atoll(decimals.c_str());
}

std::optional<StampedPose> toPose(const std::vector<std::string>& words) {
  if (words.size() != 8) return std::nullopt;
  const auto stamp_ns = toNanoseconds(words[0]);
  if (!stamp_ns) return std::nullopt;
  std::array<double, 7> numbers{};
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    const auto number = toNumber(words[i + 1]);
    if (!number) return std::nullopt;
    numbers[i] = *number;
  }
  const Eigen::Quaterniond rotation(numbers[6], numbers[3], numbers[4], numbers[5]);
  if (std::abs(rotation.norm() - 1.0) > 0.1)
    return std::nullopt;  // It was written with few digits.
  StampedPose pose{*stamp_ns, Eigen::Isometry3d::Identity()};
  pose.T_map_body.translation() = Eigen::Vector3d(numbers[0], numbers[1], numbers[2]);
  pose.T_map_body.linear() = rotation.normalized().toRotationMatrix();
  return pose;
}

}  // namespace

std::vector<StampedPose> readPoseFile(const std::string& file) {
  std::istringstream text(readFile(file));
  std::vector<StampedPose> poses;
  std::string line;
  for (int number = 1; std::getline(text, line); ++number) {
    const std::vector<std::string> words = wordsOf(line);
    if (words.empty() || words.front().front() == '#') continue;
    const auto pose = toPose(words);
    if (!pose) {
      throw MapFileError(MapFileDefect::kCorrupted,
                         file + ", line " + std::to_string(number) +
                             ": must be \"stamp x y z qx qy qz qw\", in seconds and metres, with a "
                             "quaternion of length 1");
    }
    poses.push_back(*pose);
  }
  if (poses.empty()) throw MapFileError(MapFileDefect::kCorrupted, file + " has no poses");
  return poses;
}

}  // namespace cuboid_mapping
