# SPDX-License-Identifier: BSD-3-Clause
"""Follows the map of a cuboid_mapping node."""
from cuboid_mapping_client.client import CuboidMapClient

__all__ = ['CuboidMapClient']
