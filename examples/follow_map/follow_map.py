#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Follows the map of the node and asks for a corridor, without a service call."""
import rospy
from cuboid_mapping_client import CuboidMapClient

rospy.init_node('planner')
client = CuboidMapClient('cuboid_mapping', on_change=lambda c: print('revision', c.revision))
if not client.wait_for_map(timeout=30):
    raise SystemExit('there is no map')
corridor = client.map.find_corridor((0.5, 0.5, 0.5), (3.5, 0.5, 0.5), size=(0.5, 0.5, 0.5))
print(corridor.end.name, corridor.path)                        # FOUND, or START_BLOCKED, GOAL_BLOCKED, NO_WAY
cuboids = client.map.cuboids(classes='occupied')               # numpy: boxes (n, 6), occupancy (n,) ...
