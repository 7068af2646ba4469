// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/mapper.h"

#include <pybind11/pybind11.h>

namespace cuboid_map_python {

/// The configuration that keyword arguments make of another one; needs the GIL.
/// @throws std::invalid_argument  With a line for each that is not known, of a wrong type or out of
///         range.
[[nodiscard]] cuboid_mapping::MapperConfig parseConfig(const pybind11::dict& arguments,
                                                       const cuboid_mapping::MapperConfig& base);

/// What the keyword arguments are, for docstrings.
extern const char* const kConfigHelp;

}  // namespace cuboid_map_python
