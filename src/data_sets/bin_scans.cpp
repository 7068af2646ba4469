// SPDX-License-Identifier: BSD-3-Clause
#include "data_sets/bin_scans.h"

#include "cuboid_mapping/io/file_replacement.h"
#include "data_sets/pose_lines.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

namespace cuboid_mapping {
namespace {

namespace fs = std::filesystem;

constexpr BinRow kKittiRow{4 * sizeof(float), false};

std::size_t sizeOf(const BinRow& row) { return row.has_doubles ? sizeof(double) : sizeof(float); }

double readNumber(const char* data, const BinRow& row) {
  float single = 0.0F;
  double number = 0.0;
  row.has_doubles ? std::memcpy(&number, data, sizeof(number))
                  : std::memcpy(&single, data, sizeof(single));
  return row.has_doubles ? number : static_cast<double>(single);
}

/// What speaks for a row.
struct RowEvidence {
  bool has_sense = false;  ///< Nearly all coordinates could be metres.
  /// Another column, such as the number of the ring, has whole numbers.
  bool has_integers = false;
  double unrest = std::numeric_limits<double>::infinity();  ///< From row to row, relative.
};

RowEvidence findEvidence(const std::string& bytes, const BinRow& row) {
  constexpr std::size_t kRows = 2000;  ///< Neighbours.
  RowEvidence evidence;
  const std::size_t num_columns = row.num_bytes / sizeOf(row);
  const std::size_t num_rows = std::min(kRows, bytes.size() / row.num_bytes);
  if (num_columns < 3 || num_rows == 0 || bytes.size() % row.num_bytes != 0) return evidence;
  std::vector<bool> are_whole(num_columns, true);
  std::size_t num_sane = 0;
  std::size_t num_empty = 0;  ///< Points without return, NaN.
  double sum_m = 0.0;
  double change_m = 0.0;
  Eigen::Vector3d last = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < num_rows; ++i) {
    Eigen::Vector3d point;
    for (std::size_t column = 0; column < num_columns; ++column) {
      const double number = readNumber(&bytes[i * row.num_bytes + column * sizeOf(row)], row);
      are_whole[column] = are_whole[column] && number == std::floor(number);
      if (column < 3) point[static_cast<Eigen::Index>(column)] = number;
    }
    const auto is_sane = [](double v) {
      return v == 0.0 || (std::abs(v) > 1e-5 && std::abs(v) < 1e5);
    };
    if (point.array().isNaN().all()) ++num_empty;
    if (!std::all_of(point.data(), point.data() + 3, is_sane)) continue;
    ++num_sane;
    sum_m += point.cwiseAbs().sum();
    if (i > 0) change_m += (point - last).cwiseAbs().sum();
    last = point;
  }
  evidence.has_sense = 50 * num_sane >= 49 * (num_rows - num_empty);
  evidence.has_integers =
      std::find(are_whole.begin() + 3, are_whole.end(), true) != are_whole.end();
  if (sum_m > 0.0) evidence.unrest = change_m / sum_m;
  return evidence;
}

/// The row of a file: KITTI's, unless another one makes much more sense.
std::optional<BinRow> findRow(const std::string& bytes) {
  constexpr double kFarCalmer = 0.6;
  constexpr std::size_t kFewBytes = 1000;  ///< They tell nothing against KITTI's row.
  const RowEvidence kitti = findEvidence(bytes, kKittiRow);
  std::optional<BinRow> best = kitti.has_sense ? std::make_optional(kKittiRow) : std::nullopt;
  if (best && bytes.size() < kFewBytes) return best;
  RowEvidence least = kitti;
  for (const bool has_doubles : {false, true}) {
    for (std::size_t num_columns = 3; num_columns <= 8; ++num_columns) {
      BinRow row{0, has_doubles};
      row.num_bytes = num_columns * sizeOf(row);
      const RowEvidence evidence = findEvidence(bytes, row);
      if (!evidence.has_sense) continue;
      const bool is_better =
          evidence.unrest < kFarCalmer * least.unrest ||
          (evidence.has_integers && !least.has_integers && evidence.unrest < least.unrest);
      if (best && !is_better) continue;
      best = row;
      least = evidence;
    }
  }
  return best;
}

/// Whether poses drive along their own z axis, as those of a camera that looks ahead.
bool areOfCamera(const std::vector<Eigen::Isometry3d>& poses) {
  constexpr double kLeast_m = 1.0;
  double length_m = 0.0;
  double ahead_m = 0.0;
  for (std::size_t i = 1; i < poses.size(); ++i) {
    const Eigen::Vector3d step = poses[i].translation() - poses[i - 1].translation();
    length_m += step.norm();
    ahead_m += std::abs(step.dot(poses[i].linear().col(2)));
  }
  return length_m >= kLeast_m && ahead_m > 0.9 * length_m;
}

/// Transform from lidar to camera, since KITTI's poses are those of the camera. Without the file, they are those of the
/// lidar: identity. @throws std::runtime_error if they cannot be.
Eigen::Isometry3d readCalibration(const fs::path& file,
                                  const std::vector<Eigen::Isometry3d>& poses) {
  std::ifstream in(file);
  if (!in && areOfCamera(poses)) {
    throw std::runtime_error(
        "there is no " + file.string() +
        ", and the poses drive along their z axis, as a camera's do: add the calib.txt of the "
        "recording, whose 'Tr:' takes points from lidar to camera. If the lidar did drive so, "
        "write "
        "'Tr: 1 0 0 0 0 1 0 0 0 0 1 0' to it");
  }
  if (!in) return Eigen::Isometry3d::Identity();
  // Odometry, object detection, tracking; the latter two also rectify.
  constexpr std::array<const char*, 5> kNames{"Tr", "Tr_velo_to_cam", "Tr_velo_cam", "Tr_velo2cam",
                                              "velo_to_cam"};
  std::optional<Eigen::Isometry3d> T_camera_sensor;
  Eigen::Isometry3d T_rectified_camera = Eigen::Isometry3d::Identity();
  std::string line;
  while (std::getline(in, line)) {
    std::istringstream words(line);
    std::string name;
    words >> name;
    if (!name.empty() && name.back() == ':') name.pop_back();
    const std::vector<double> numbers{std::istream_iterator<double>(words), {}};
    if (std::find(kNames.begin(), kNames.end(), name) != kNames.end()) {
      T_camera_sensor = numbers.size() == 12 ? toPose(numbers) : std::nullopt;
      if (!T_camera_sensor) {
        throw std::runtime_error(file.string() + ": expected '" + name + "' and 12 numbers");
      }
    } else if ((name == "R0_rect" || name == "R_rect") && numbers.size() == 9) {
      T_rectified_camera.linear() =
          Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(numbers.data());
    }
  }
  if (!T_camera_sensor) {
    throw std::runtime_error(file.string() +
                             " has no transform from lidar to camera, whose poses poses.txt gives: "
                             "add 'Tr:' and 12 numbers, or remove the file if the poses are those "
                             "of the lidar");
  }
  return T_rectified_camera * *T_camera_sensor;
}

class BinScans : public ScanDataset {
 public:
  BinScans(const fs::path& folder, std::vector<fs::path> files, const BinRow& row)
      : files_(std::move(files)), row_(row) {
    const fs::path file = folder / "poses.txt";
    readLines(file, std::string("r11 r12 r13 tx r21 ... tz' or '") + kIndexedPose,
              [&](const std::vector<double>& numbers) {
                const auto pose = toPose(numbers);
                if (pose) poses_.push_back(*pose);
                return pose.has_value();
              });
    const Eigen::Isometry3d T_camera_sensor = readCalibration(folder / "calib.txt", poses_);
    for (Eigen::Isometry3d& pose : poses_)
      pose = T_camera_sensor.inverse() * pose * T_camera_sensor;
    if (poses_.size() != files_.size()) {
      throw std::runtime_error(file.string() + " has " + std::to_string(poses_.size()) +
                               " poses, but there are " + std::to_string(files_.size()) +
                               " .bin files");
    }
    if (row_.num_bytes == 0) chooseRow();
  }

  [[nodiscard]] std::size_t size() const override { return files_.size(); }

  [[nodiscard]] Item read(std::size_t index) const override {
    const std::string bytes = readFile(files_.at(index).string());
    if (bytes.size() % row_.num_bytes != 0) refuse(files_[index]);
    Item item;
    item.T_map_sensor = poses_[index];
    item.points_sensor.reserve(bytes.size() / row_.num_bytes);
    for (std::size_t i = 0; i < bytes.size(); i += row_.num_bytes) {
      Eigen::Vector3f point;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        point[static_cast<Eigen::Index>(axis)] =
            static_cast<float>(readNumber(&bytes[i + axis * sizeOf(row_)], row_));
      }
      item.points_sensor.push_back(point);
    }
    return item;
  }

 private:
  /// Chooses the row by the first file with points.
  void chooseRow() {
    row_ = kKittiRow;
    for (const fs::path& file : files_) {
      const std::string bytes = readFile(file.string());
      if (bytes.empty()) continue;
      const auto row = findRow(bytes);
      if (!row) refuse(file);
      row_ = *row;
      return;
    }
  }

  [[noreturn]] void refuse(const fs::path& file) const {
    throw std::runtime_error(
        "cannot read " + file.string() + ": these are no rows of " +
        std::to_string(row_.num_bytes) +
        " bytes that begin with x y z. Name the bytes of a row, such as 20 for "
        "five float32, or 24d for three float64: --bin-row");
  }

  std::vector<fs::path> files_;
  std::vector<Eigen::Isometry3d> poses_;
  BinRow row_;
};

}  // namespace

BinRow parseBinRow(const std::string& text) {
  BinRow row;
  if (text.empty()) return row;
  std::istringstream words(text);
  std::string kind;
  const bool has_number = static_cast<bool>(words >> row.num_bytes);
  words >> kind;
  row.has_doubles = kind == "d";
  const bool is_known = has_number && (kind.empty() || row.has_doubles);
  if (!is_known || row.num_bytes < 3 * sizeOf(row) || row.num_bytes > 1000) {
    throw std::runtime_error(
        "--bin-row " + text +
        ": must be the bytes of a row, such as 20 or 24d, which begins with x, "
        "y and z as float32, or as float64 with d");
  }
  return row;
}

std::unique_ptr<ScanDataset> openBinScans(const fs::path& folder, std::vector<fs::path> files,
                                          const BinRow& row) {
  return std::make_unique<BinScans>(folder, std::move(files), row);
}

}  // namespace cuboid_mapping
