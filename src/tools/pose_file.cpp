// SPDX-License-Identifier: BSD-3-Clause
#include "pose_file.h"

#include "cuboid_mapping/io/file_replacement.h"
#include "cuboid_mapping/io/text.h"
#include "data_sets/pose_lines.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <sstream>

namespace cuboid_mapping {
namespace {

/// Bound of stamps: 285 years. Greater ones count milli-, micro- or nanoseconds, ...
constexpr double kMaxStamp_s = 9e9;
/// ... if they are dates then, after 2001: no other unit would make sense.
constexpr double kLeastDate_s = 1e9;
/// Numbers of a pose.
constexpr std::size_t kColumns = 8;

std::optional<double> toNumber(const std::string& word) {
  std::istringstream in(word);
  in.imbue(std::locale::classic());
  double number = 0.0;
  if (!(in >> number) || !in.eof() || !std::isfinite(number)) return std::nullopt;
  return number;
}

/// Parses the decimals apart: a double of today's stamps has steps of 240 ns.
std::optional<std::int64_t> toNanoseconds(const std::string& word) {
  auto seconds = toNumber(word);
  if (!seconds) return std::nullopt;
  std::int64_t unit_ns = 1000000000;
  for (; std::abs(*seconds) > kMaxStamp_s && unit_ns > 1; unit_ns /= 1000) *seconds *= 1e-3;
  if (std::abs(*seconds) > kMaxStamp_s) return std::nullopt;
  if (unit_ns < 1000000000) {
    if (*seconds < kLeastDate_s) return std::nullopt;
    const bool is_whole = word.find_first_not_of("0123456789") == std::string::npos;
    return is_whole ? std::atoll(word.c_str()) * unit_ns : std::llround(*seconds * 1e9);
  }
  const std::size_t point = word.find('.');
  if (point == std::string::npos || word.find_first_not_of("0123456789.") != std::string::npos) {
    return std::llround(*seconds * 1e9);
  }
  std::string decimals = word.substr(point + 1, 9);
  decimals.resize(9, '0');
  return std::atoll(word.substr(0, point).c_str()) * 1000000000 + std::atoll(decimals.c_str());
}

/// The first letter of a quaternion, where a line names columns, such as qw or q_RS_w; else 0.
char firstOfQuaternion(const std::vector<std::string>& words) {
  for (const std::string& word : words) {
    const bool is_part = word.find_last_of("wxyz") == word.size() - 1;
    if (word.size() > 1 && word.front() == 'q' && is_part) return word.back();
  }
  return '\0';
}

std::optional<StampedPose> toPose(const std::vector<std::string>& words, bool has_w_first) {
  if (words.size() != kColumns) return std::nullopt;
  const auto stamp_ns = toNanoseconds(words[0]);
  if (!stamp_ns) return std::nullopt;
  std::array<double, 7> numbers{};
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    const auto number = toNumber(words[i + 1]);
    if (!number) return std::nullopt;
    numbers[i] = *number;
  }
  if (has_w_first) std::rotate(numbers.begin() + 3, numbers.begin() + 4, numbers.end());
  const Eigen::Quaterniond rotation(numbers[6], numbers[3], numbers[4], numbers[5]);
  if (std::abs(rotation.norm() - 1.0) > 0.1) return std::nullopt;  // Few digits pass.
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
  std::string last;
  char first = '\0';
  for (int number = 1; std::getline(text, line); ++number) {
    if (number == 1) dropByteOrderMark(line);
    std::replace(line.begin(), line.end(), ',', ' ');
    std::vector<std::string> words = wordsOf(line);
    if (const char named = firstOfQuaternion(words)) {
      first = named;
      continue;
    }
    if (words.empty() || words.front().front() == '#' || line == last) continue;
    last = line;
    if (first != '\0' && words.size() > kColumns) words.resize(kColumns);
    const auto pose = toPose(words, first == 'w');
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
