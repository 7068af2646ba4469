// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "map_adapter.h"

#include <string>
#include <vector>

namespace cuboid_mapping::bench {

using PeerMaker = std::unique_ptr<PeerAdapter> (*)(const InsertionConfig& config);

/// A map to compare with.
struct Peer {
  std::string name;          ///< In --peers and in the report.
  PeerMaker make = nullptr;  ///< Null if this program was built without it.
  std::string needs;         ///< What has to be installed to build with it.
};

/// Also those that this program was built without.
[[nodiscard]] const std::vector<Peer>& allPeers();

/// @pre There is a peer of this name.
[[nodiscard]] const Peer& findPeer(const std::string& name);

}  // namespace cuboid_mapping::bench
