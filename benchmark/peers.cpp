// SPDX-License-Identifier: BSD-3-Clause
#include "peers.h"

#include <algorithm>

namespace cuboid_mapping::bench {

const std::vector<Peer>& allPeers() {
  static const std::vector<Peer> kPeers{
      {"octomap", makeOctomapAdapter, "liboctomap-dev"},
      {"octomap_lazy", makeLazyOctomapAdapter, "liboctomap-dev"},
      {"octomap_discrete", makeDiscreteOctomapAdapter, "liboctomap-dev"},
#include "optional_peers.inc"  // By CMake: a null maker where it has not found the headers.
  };
  return kPeers;
}

const Peer& findPeer(const std::string& name) {
  const auto& peers = allPeers();
  return *std::find_if(peers.begin(), peers.end(),
                       [&name](const Peer& peer) { return peer.name == name; });
}

}  // namespace cuboid_mapping::bench
