// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/history/pose_track.h"

#include <string>
#include <vector>

namespace cuboid_mapping {

/// Reads poses in the format of the TUM benchmark, which SLAM programs write: a line "stamp x y z qx qy qz qw"
/// for each, in seconds and metres; empty lines, lines that begin with # and a line that repeats the one before are
/// skipped. Stamps are read to the nanosecond. As in EuRoC's files, commas may divide the numbers, stamps may count
/// nanoseconds since 1970 (or us, ms), and a line may name the columns, such as qw, qx: then qw may come first, and other
/// columns follow.
/// @throws MapFileError  naming the file, and the line that is no pose.
[[nodiscard]] std::vector<StampedPose> readPoseFile(const std::string& file);

}  // namespace cuboid_mapping
