// SPDX-License-Identifier: BSD-3-Clause
// Eigen's Isometry3d, for all headers whose interface has one.
//
// Compiler flags such as -mavx and -march=native change its alignment, and with it the layout of our types: a program
// that has other ones than the library does not link. Build the library with these flags, too, or the program with
// -DEIGEN_MAX_ALIGN_BYTES=16.
#pragma once

#include "cuboid_mapping/geometry/standard_containers.h"

#include <Eigen/Geometry>

#include <cstddef>

namespace cuboid_mapping {

/// Alignment of Eigen's types in bytes. The library defines that of its own flags.
template <std::size_t Bytes>
struct EigenAlignment {
  static const char kIsThatOfTheLibrary;  ///< Undefined for other flags.
};
/// @cond
template <>
const char EigenAlignment<alignof(Eigen::Isometry3d)>::kIsThatOfTheLibrary;

namespace detail {
// Refers to the library's alignment in every program.
[[gnu::used]] inline const char* const kEigenAlignment =
    &EigenAlignment<alignof(Eigen::Isometry3d)>::kIsThatOfTheLibrary;
}  // namespace detail
/// @endcond

}  // namespace cuboid_mapping
