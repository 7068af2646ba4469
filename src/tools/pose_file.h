// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/history/pose_track.h"

#include <string>
#include <vector>

namespace cuboid_mapping {

/// Reads poses in the format of the TUM benchmark, which SLAM programs write: a line "stamp x y z qx qy qz qw"
/// for each, in seconds and metres; empty lines and lines that begin with # are skipped. Stamps are read to the
/// nanosecond.
/// @throws MapFileError  naming the file, and the line that is no pose.
[[nodiscard]] std::vector<StampedPose> readPoseFile(const std::string& file);

}  // namespace cuboid_mapping
