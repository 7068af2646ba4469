#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The running node, and the Python client that follows its map."""
import time
import unittest

import rospy
import rostest
from geometry_msgs.msg import Point

from cuboid_mapping.srv import GetCuboids, GetCuboidsRequest, SetBox, SetBoxRequest
from cuboid_mapping_client import CuboidMapClient

NODE = '/cuboid_mapping'


def wait_for(condition):
    deadline = time.time() + 60.0
    while time.time() < deadline:
        if condition():
            return True
        time.sleep(0.02)
    return False


class PythonClientTest(unittest.TestCase):

    def setUp(self):
        rospy.wait_for_service(NODE + '/set_box', 60.0)
        self.set_box_service = rospy.ServiceProxy(NODE + '/set_box', SetBox)

    def set_box(self, low, high, occupancy):
        answer = self.set_box_service(
            min=[Point(*low)], max=[Point(*high)], occupancy=occupancy)
        self.assertTrue(answer.success, answer.message)
        return answer.revision

    def expect_same_map(self, client):
        answer = rospy.ServiceProxy(NODE + '/get_cuboids', GetCuboids)(
            everything=True, classes=GetCuboidsRequest.ALL)
        self.assertTrue(wait_for(lambda: client.revision >= answer.revision))
        self.assertEqual(client.revision, answer.revision)
        num_voxels = 0
        for low, high, occupancy in zip(answer.min, answer.max, answer.occupancy):
            free, occupied, unknown = client.count((low.x, low.y, low.z), (high.x, high.y, high.z))
            self.assertEqual(unknown, 0)
            self.assertEqual(free if occupancy == 2 else occupied, 0)
            num_voxels += free + occupied
        found = client.cuboids()
        volumes = (found.bounds[:, 3:] - found.bounds[:, :3]).prod(axis=1)
        self.assertEqual(int(volumes.sum()), num_voxels)

    def test_follows_edits_from_the_beginning_and_late(self):
        changes = []
        client = CuboidMapClient(NODE, on_change=changes.append)
        self.assertTrue(wait_for(lambda: client.has_map))
        self.set_box((-5, -5, -5), (5, 5, 5), SetBoxRequest.FREE)
        self.set_box((-1, -1, -1), (1, 1, 30), SetBoxRequest.OCCUPIED)
        self.expect_same_map(client)
        late = CuboidMapClient(NODE)
        self.set_box((0, 0, 0), (2, 2, 2), SetBoxRequest.UNKNOWN)
        for each in (client, late):
            self.assertTrue(wait_for(lambda each=each: each.has_map))
            self.expect_same_map(each)
            self.assertEqual(each.frame_id, 'map')
            self.assertAlmostEqual(each.resolution, 0.1)
            self.assertEqual(each.count((0, 0, 0), (1, 1, 2.5)), (0, 500, 2000))
        self.assertGreaterEqual(len(changes), 2)


if __name__ == '__main__':
    rospy.init_node('test_python_client')
    rostest.rosrun('cuboid_mapping', 'python_client', PythonClientTest)
