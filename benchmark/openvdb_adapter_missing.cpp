// SPDX-License-Identifier: BSD-3-Clause
// Built in place of openvdb_adapter.cpp where there is no OpenVDB.
#include "map_adapter.h"

namespace cuboid_mapping::bench {

std::unique_ptr<PeerAdapter> makeOpenvdbAdapter(const InsertionConfig& /*config*/,
                                                int /*threads*/) {
  return nullptr;
}

}  // namespace cuboid_mapping::bench
