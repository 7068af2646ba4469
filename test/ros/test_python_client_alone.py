#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The Python client without a node that serves a map."""
import unittest
from unittest import mock

import rospy
import rostest

from cuboid_mapping.msg import FullCuboidMap
from cuboid_mapping.srv import GetMap
from cuboid_mapping_client import CuboidMapClient, client as client_module
from waiting import wait_for


class PythonClientAloneTest(unittest.TestCase):

    def test_says_that_nobody_serves_the_map_and_gives_up_in_time(self):
        lines = []
        with mock.patch.object(client_module, '_PATIENCE_S', 0.3), \
                mock.patch.object(rospy, 'logwarn', lambda text, *values: lines.append(text % values)), \
                CuboidMapClient('no_node') as client:
            self.assertFalse(client.wait_for_map(1.0))
            self.assertFalse(client.has_map)
        self.assertGreaterEqual(len(lines), 2, 'while it waits, and when it gives up')
        self.assertIn('no map has come on /alone/cuboid_map yet, and nobody serves /alone/no_node/get_map', lines[0])

    def test_follows_one_of_two_nodes_that_publish_to_one_topic(self):
        rospy.wait_for_service('/cuboid_mapping/get_map', 30.0)
        image = rospy.ServiceProxy('/cuboid_mapping/get_map', GetMap)().map
        lines = []
        publisher = rospy.Publisher('cuboid_map', FullCuboidMap, queue_size=10)

        def publish(server, revision):
            image.server, image.instance, image.revision = server, revision, revision
            publisher.publish(image)

        with mock.patch.object(rospy, 'logwarn_throttle', lambda period, text: lines.append(text)), \
                CuboidMapClient('named') as client:
            self.assertTrue(wait_for(lambda: publisher.get_num_connections() > 0))
            publish('/first', 5)
            self.assertTrue(wait_for(lambda: client.revision == 5))
            publish('/second', 6)
            self.assertTrue(wait_for(lambda: lines))
            self.assertEqual(lines[0], 'two nodes publish /alone/cuboid_map: /first, which is followed, and /second: '
                             'start each in a namespace of its own')
            self.assertEqual(client.revision, 5)
            publish('/alone/named', 7)
            self.assertTrue(wait_for(lambda: client.revision == 7), 'the named node comes before the first')
            publish('/first', 8)
            self.assertTrue(wait_for(lambda: len(lines) > 1))
            self.assertEqual(client.revision, 7)

    def test_refuses_questions(self):
        with CuboidMapClient('no_node') as client, self.assertRaisesRegex(RuntimeError, 'no map has come yet'):
            client.map.cuboids()


if __name__ == '__main__':
    rospy.init_node('test_python_client_alone')
    rostest.rosrun('cuboid_mapping', 'python_client_alone', PythonClientAloneTest)
