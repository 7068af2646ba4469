#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Three simulated robots, each with a map of its own, and the map of all three."""
import time
import unittest

import rospy
import tf2_ros
from cuboid_mapping.srv import QueryBox, QueryBoxRequest, QueryBoxResponse
from geometry_msgs.msg import Point

PATIENCE_S = 120.0
ROBOTS = ('robot1', 'robot2', 'robot3')


def wait_for(what):
    """Result of a function, when it is not empty."""
    end = time.time() + PATIENCE_S
    while time.time() < end:
        found = what()
        if found:
            return found
        time.sleep(0.2)
    return what()


def is_free(server, place):
    """Whether 0.2 m around a place are known to be free in a map."""
    rospy.wait_for_service(f'{server}/query_box', PATIENCE_S)
    request = QueryBoxRequest(min=Point(*(x - 0.1 for x in place)), max=Point(*(x + 0.1 for x in place)))
    answer = rospy.ServiceProxy(f'{server}/query_box', QueryBox)(request)
    return answer.success and answer.occupancy == QueryBoxResponse.FREE


class FleetDemoTest(unittest.TestCase):

    def test_all_robots_are_in_the_merged_map(self):
        buffer = tf2_ros.Buffer()
        listener = tf2_ros.TransformListener(buffer)

        def place_of(robot):
            try:
                found = buffer.lookup_transform('map', f'{robot}/lidar', rospy.Time(0)).transform.translation
                return found.x, found.y, found.z
            except tf2_ros.TransformException:
                return None

        places = {robot: wait_for(lambda: place_of(robot)) for robot in ROBOTS}
        self.assertIsNotNone(listener)
        for one, other in (('robot1', 'robot2'), ('robot2', 'robot3'), ('robot3', 'robot1')):
            self.assertGreater(max(abs(a - b) for a, b in zip(places[one], places[other])), 3.0)
        for robot, place in places.items():
            self.assertTrue(wait_for(lambda: is_free(f'/{robot}/cuboid_mapping', place)), robot)
            self.assertTrue(wait_for(lambda: is_free('/cuboid_mapping', place)), robot)


if __name__ == '__main__':
    import rostest
    rospy.init_node('test_fleet_demo')
    rostest.rosrun('cuboid_mapping', 'fleet_demo', FleetDemoTest)
