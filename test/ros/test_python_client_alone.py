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
                CuboidMapClient() as client:
            self.assertTrue(wait_for(lambda: publisher.get_num_connections() > 0))
            publish('/first', 5)
            self.assertTrue(wait_for(lambda: client.revision == 5))
            publish('/second', 6)
            self.assertTrue(wait_for(lambda: lines))
            self.assertIn('ignored the map of /second on /alone/cuboid_map: /first is followed', lines[0])
            self.assertEqual(client.revision, 5)
            publish('/alone/cuboid_mapping', 7)
            self.assertTrue(wait_for(lambda: client.revision == 7), 'the default name comes before the first')
            publish('/first', 8)
            self.assertTrue(wait_for(lambda: len(lines) > 1))
            self.assertEqual(client.revision, 7)

    def test_follows_only_the_node_that_it_is_given_by_the_topics_beside_it(self):
        rospy.wait_for_service('/cuboid_mapping/get_map', 30.0)
        image = rospy.ServiceProxy('/cuboid_mapping/get_map', GetMap)().map
        # A topic for each: rospy keeps the connection of the client before until it next writes to it.
        for server, topic, mappings in (
                ('/given/node', '/given/cuboid_map', {}),
                ('node', '/elsewhere/cuboid_map', {'/alone/cuboid_map': '/elsewhere/cuboid_map'})):
            lines = []
            with mock.patch.object(rospy, 'logwarn_throttle', lambda period, text, said=lines: said.append(text)), \
                    mock.patch.dict(rospy.names._resolved_mappings, mappings), CuboidMapClient(server) as client:
                publisher = rospy.Publisher(topic, FullCuboidMap, queue_size=10)
                self.addCleanup(publisher.unregister)
                self.assertTrue(wait_for(lambda each=publisher: each.get_num_connections() > 0))
                named = rospy.resolve_name(server)
                image.server, image.instance, image.revision = '/given/other', 3, 3
                publisher.publish(image)
                self.assertTrue(wait_for(lambda said=lines: said))
                self.assertIn(f'ignored the map of /given/other on {topic}: {named} is followed', lines[0])
                self.assertEqual(client.instance, 0)
                image.server = named
                publisher.publish(image)
                self.assertTrue(wait_for(lambda each=client: each.instance == 3))

    def test_refuses_questions(self):
        with CuboidMapClient('no_node') as client, self.assertRaisesRegex(RuntimeError, 'no map has come yet'):
            client.map.cuboids()


if __name__ == '__main__':
    rospy.init_node('test_python_client_alone')
    rostest.rosrun('cuboid_mapping', 'python_client_alone', PythonClientAloneTest)
