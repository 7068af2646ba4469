// SPDX-License-Identifier: BSD-3-Clause
// A program with -D_GLIBCXX_DEBUG has other containers than a library without it, and must not link with it.
// Build both with this flag, or none.
#pragma once

#include <cstddef>
#include <vector>

namespace cuboid_mapping {

/// Size of a std::vector in bytes. The library defines that of its own flags.
template <std::size_t Bytes>
struct StandardVector {
  static const char kIsThatOfTheLibrary;  ///< Undefined for other flags.
};
/// @cond
template <>
const char StandardVector<sizeof(std::vector<char>)>::kIsThatOfTheLibrary;

namespace detail {
// Refers to the library's containers in every program.
[[gnu::used]] inline const char* const kStandardVector =
    &StandardVector<sizeof(std::vector<char>)>::kIsThatOfTheLibrary;
}  // namespace detail
/// @endcond

}  // namespace cuboid_mapping
