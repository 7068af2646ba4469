#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""A running node that publishes log-odds, and the Python client that follows its map."""
import math
import unittest
from types import SimpleNamespace
from unittest import mock

import rospy
import rostest
from cuboid_map import MapFollower
from geometry_msgs.msg import Point

from cuboid_mapping.msg import Box, CuboidMapUpdate, FullCuboidMap
from cuboid_mapping.srv import GetMap, SetBox, SetBoxRequest
from cuboid_mapping_client import CuboidMapClient, client as client_module
from waiting import wait_for

NODE = '/values/cuboid_mapping'


def centre(voxel):
    return [0.1 * (value + 0.5) for value in voxel]


class PythonClientValuesTest(unittest.TestCase):

    def setUp(self):
        rospy.wait_for_service(NODE + '/set_box', 60.0)
        self.client = CuboidMapClient(NODE)
        self.addCleanup(self.client.close)
        self.assertTrue(wait_for(lambda: self.client.instance != 0))

    def set_box(self, low, high, probability):
        occupancy = SetBoxRequest.OCCUPIED if probability >= 0.5 else SetBoxRequest.FREE
        answer = rospy.ServiceProxy(NODE + '/set_box', SetBox)(
            boxes=[Box(Point(*low), Point(*high))], occupancy=occupancy, probability=probability)
        self.assertTrue(answer.info.success, answer.info.message)
        self.assertTrue(wait_for(lambda: self.client.revision >= answer.info.revision))

    def expect_probability(self, voxel, probability):
        (log_odds,) = self.client.map.log_odds([centre(voxel)])
        self.assertAlmostEqual(float(log_odds), math.log(probability / (1 - probability)), places=5)

    def test_has_the_log_odds_of_every_voxel(self):
        self.set_box((-1, -1, -1), (1, 1, 1), 0.3)
        self.set_box((0, 0, 0), (0.1, 0.1, 0.1), 0.8)
        self.set_box((0.1, 0, 0), (0.2, 0.1, 0.1), 0.31)  # The class does not change.
        self.expect_probability((0, 0, 0), 0.8)
        self.expect_probability((1, 0, 0), 0.31)
        self.expect_probability((2, 0, 0), 0.3)
        self.assertTrue(math.isnan(self.client.map.log_odds([centre((20, 0, 0))])[0]))
        copy = MapFollower()
        copy.take_map(rospy.ServiceProxy(NODE + '/get_map', GetMap)(with_values=True).map)
        points = [centre((x, 0, 0)) for x in range(-10, 10)]
        self.assertEqual(copy.log_odds(points).tolist(), self.client.map.log_odds(points).tolist(), 'bit by bit')

    def test_fetches_the_parts_of_a_large_map_in_their_order(self):
        whole = FullCuboidMap(num_parts=3, revision=7)
        whole.bricks.has_values = True
        asked = []

        def get_map(**request):
            asked.append(request)
            return SimpleNamespace(info=SimpleNamespace(success=True), map=request['part'])

        self.assertEqual(client_module.fetch_parts(get_map, whole), [whole, 1, 2])
        self.assertEqual(asked, [{'with_values': True, 'part': part, 'revision': 7} for part in (1, 2)])

    def test_has_them_after_updates_were_lost(self):
        self.set_box((-1, -1, -1), (1, 1, 1), 0.3)
        server = rospy.ServiceProxy(NODE + '/get_map', GetMap)().map
        self.client._map = MapFollower()  # As if all updates were lost.
        lost = CuboidMapUpdate(server=server.server, instance=server.instance, base=7, revision=8, resolution=0.1)
        lost.bricks.has_values = True
        with mock.patch.object(client_module, '_PATIENCE_S', 0.0):
            self.client._take_update(lost)
        self.expect_probability((2, 2, 2), 0.3)


if __name__ == '__main__':
    rospy.init_node('test_python_client_values')
    rostest.rosrun('cuboid_mapping', 'python_client_values', PythonClientValuesTest)
