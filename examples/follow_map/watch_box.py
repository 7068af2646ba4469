#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Follows the map of the node, and prints the occupied volume of a box whenever the map changes."""
import rospy
from cuboid_mapping_client import CuboidMapClient

BOX = (-0.6, 0.2, 0.1, 0.3, 1.0, 0.4)  # Above the table: min x, y, z, max x, y, z [m].


def report(client):
    print('revision', client.revision, 'occupied m3:', client.map.query_boxes([BOX]).occupied_volume[0])


rospy.init_node('watch_box')
client = CuboidMapClient('cuboid_mapping', on_change=report)
rospy.spin()
