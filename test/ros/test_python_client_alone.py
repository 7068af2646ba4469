#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The Python client without a node that serves a map."""
import unittest
from unittest import mock

import rospy
import rostest

from cuboid_mapping_client import CuboidMapClient, client as client_module


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

    def test_refuses_questions(self):
        with CuboidMapClient('no_node') as client, self.assertRaisesRegex(RuntimeError, 'no map has come yet'):
            client.map.cuboids()


if __name__ == '__main__':
    rospy.init_node('test_python_client_alone')
    rostest.rosrun('cuboid_mapping', 'python_client_alone', PythonClientAloneTest)
