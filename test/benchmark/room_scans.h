// SPDX-License-Identifier: BSD-3-Clause
// A small data set for programs: a few scans of a room.
#pragma once

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace cuboid_mapping::bench::test {

constexpr int kNumScans = 3;
constexpr int kNumPoints = 1500;

inline Eigen::Isometry3d makePose(int scan) {
  return Eigen::Translation3d(0.7 * scan, 0.13, 1.1) *
         Eigen::AngleAxisd(0.4 * scan, Eigen::Vector3d::UnitZ());
}

/// Points at which beams in a spiral of directions meet the walls of a room of 8 x 6 x 3 m.
inline std::vector<Eigen::Vector3f> makePoints(int scan) {
  const Eigen::Isometry3d pose = makePose(scan);
  const Eigen::Vector3d lower(-4.0, -3.0, 0.0);
  const Eigen::Vector3d upper(4.0, 3.0, 3.0);
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < kNumPoints; ++i) {
    const double z = 0.95 * (2.0 * (i + 0.5) / kNumPoints - 1.0);
    const double azimuth = 2.39996 * (i + 0.5);
    const Eigen::Vector3d direction(std::sqrt(1 - z * z) * std::cos(azimuth),
                                    std::sqrt(1 - z * z) * std::sin(azimuth), z);
    double range = 100.0;
    for (int axis = 0; axis < 3; ++axis) {
      const double wall = direction[axis] > 0.0 ? upper[axis] : lower[axis];
      range = std::min(range, (wall - pose.translation()[axis]) / direction[axis]);
    }
    const Eigen::Vector3d end = pose.translation() + range * direction;
    points.emplace_back((pose.inverse() * end).cast<float>());
  }
  return points;
}

inline void writeScanFolder(const std::string& folder) {
  std::filesystem::create_directories(folder + "/scans");
  std::ofstream poses(folder + "/poses.txt");
  poses.precision(17);
  for (int scan = 0; scan < kNumScans; ++scan) {
    const Eigen::Vector3d t = makePose(scan).translation();
    const Eigen::Quaterniond q(makePose(scan).linear());
    poses << scan << ' ' << t.transpose() << ' ' << q.coeffs().transpose() << '\n';
    std::ofstream pcd(folder + "/scans/000" + std::to_string(scan) + ".pcd");
    pcd.precision(9);
    pcd << "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH " << kNumPoints
        << "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " << kNumPoints << "\nDATA ascii\n";
    for (const Eigen::Vector3f& point : makePoints(scan)) pcd << point.transpose() << '\n';
  }
}

}  // namespace cuboid_mapping::bench::test
