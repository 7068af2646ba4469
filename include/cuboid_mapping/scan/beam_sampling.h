// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace cuboid_mapping {

/// Random sampling of cells along beams (paper, Section IV-B and Figure 4(a)).
struct BeamSampling {
  /// Expected number of draws per metre of beam up to the max range, 0 to 100; 0: none.
  double per_m = 0.0;
  int seed = 1;  ///< The same seed, scans and order of scans give the same cells.
};

}  // namespace cuboid_mapping
