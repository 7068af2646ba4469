// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/files/map_files.h"

#include "cuboid_mapping/ros/parameters/parameter_table.h"

namespace cuboid_mapping_ros {
namespace {

using P = NodeParameters;

}  // namespace

std::vector<ParameterDeclaration> MapFiles::declare() {
  return {
      {"autosave_file", "", file(&P::autosave_file),
       "The map is saved to this file after changes and when the node stops. A file that exists at "
       "the start and is not read (see resume) is not replaced: saves go to a new file beside it. "
       "The extension selects the format, as with ~save_map. Empty: the map is not saved."},
      {"resume", "", boolean(&P::resume),
       "true: the node goes on with the map of autosave_file and its locked boxes, if the file "
       "exists and map_file is empty. It does not start if the file cannot be read, or has another "
       "resolution."},
      {"autosave_period", "s", number(&P::autosave_period_s, 1.0, 86400.0),
       "Time between two saves to autosave_file, or to window/file."},
  };
}

}  // namespace cuboid_mapping_ros
