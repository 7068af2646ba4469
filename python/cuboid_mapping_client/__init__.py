# SPDX-License-Identifier: BSD-3-Clause
"""Follows the map of a cuboid_mapping node into numpy arrays."""
from cuboid_mapping_client.client import CuboidMapClient
from cuboid_mapping_client.map_copy import Cuboids, DamagedMessage, MapCopy

__all__ = ['CuboidMapClient', 'Cuboids', 'DamagedMessage', 'MapCopy']
