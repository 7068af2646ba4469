// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/map/mapper.h"

#include <pybind11/pybind11.h>

namespace cuboid_map_python {

/// A configuration changed by keyword arguments; needs the GIL.
/// @throws std::invalid_argument  with a line for each argument that is unknown, of a wrong type or out of
///         range.
[[nodiscard]] cuboid_mapping::MapperConfig parseConfig(const pybind11::dict& arguments,
                                                       const cuboid_mapping::MapperConfig& base);

/// Description of the keyword arguments, for docstrings.
extern const char* const kConfigHelp;

}  // namespace cuboid_map_python
