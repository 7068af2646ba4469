#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Launch files that set /use_sim_time map with it, and put it back when they end."""
import contextlib
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import time
import unittest

import rosbag
import rospy
import rostest
from geometry_msgs.msg import Point
from sensor_msgs import point_cloud2
from std_msgs.msg import Header
from waiting import wait_for

from cuboid_mapping.srv import QueryBox, QueryBoxResponse

PROGRAM = pathlib.Path(__file__).resolve().parents[2] / 'python/restore_sim_time'


class SimTimeTest(unittest.TestCase):

    def test_the_master_is_left_as_it_was(self):
        for before in (None, True, False):
            if before is not None:
                rospy.set_param('/use_sim_time', before)
            with launched('demo.launch', 'rviz:=false'):
                self.assertTrue(wait_for(lambda: '/restore_sim_time' in nodes()))
                self.assertTrue(rospy.get_param('/use_sim_time'))
            self.assertEqual(rospy.get_param('/use_sim_time', None), before)
        rospy.delete_param('/use_sim_time')

    def test_a_bag_is_replayed_into_a_nodelet(self):
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / 'points.bag'
            with rosbag.Bag(file, 'w') as bag:
                for i in range(20):
                    stamp = rospy.Time(100.0 + 0.1 * i)
                    bag.write('/points', point_cloud2.create_cloud_xyz32(Header(frame_id='lidar', stamp=stamp), [(5.01, 0.01, 0.01)]),
                              stamp)
            with launched('replay.launch', f'bag:={file}', 'cloud:=/points', 'nodelet:=true', 'transform:=map lidar 1 0 0 0 0 0',
                          '__ns:=robot1'):
                self.assertTrue(wait_for(lambda: is_occupied('/robot1/cuboid_mapping', 6.01)))

    def test_the_planner_has_the_map_of_the_demo(self):
        with launched('planner.launch', 'rviz:=false', 'rate:=5'):
            self.assertTrue(wait_for(lambda: '/example_planner' in nodes()))
            self.assertTrue(wait_for(lambda: is_occupied('/cuboid_mapping', None)))

    def test_help_needs_no_master(self):
        nobody = {**os.environ, 'ROS_MASTER_URI': 'http://localhost:1'}
        answer = subprocess.run([sys.executable, PROGRAM, '--help'], env=nobody, timeout=20, check=True, stdout=subprocess.PIPE)
        self.assertIn(b'/use_sim_time', answer.stdout)

    def test_it_ends_whenever_it_is_stopped(self):
        for delay_s in (0.0, 0.001, 0.002, 0.005, 0.01):  # rospy is still starting.
            self.assertTrue(wait_for(lambda: '/restore_sim_time' not in nodes()))
            rospy.set_param('/use_sim_time', True)
            node = subprocess.Popen([sys.executable, PROGRAM])
            try:
                self.assertTrue(wait_for(lambda: '/restore_sim_time' in nodes()))
                time.sleep(delay_s)
                node.send_signal(signal.SIGINT)
                node.wait(timeout=20)
                self.assertFalse(rospy.has_param('/use_sim_time'))
            finally:
                node.kill()


@contextlib.contextmanager
def launched(*words):
    """A launch file of this package, until the block ends."""
    launch = subprocess.Popen(['roslaunch', 'cuboid_mapping', *words], start_new_session=True)
    try:
        yield
    finally:
        launch.send_signal(signal.SIGINT)
        launch.wait()


def is_occupied(node, x):
    """Whether a node's map is occupied at (x, 0.01, 0.01), or anywhere near; false while nobody answers."""
    reach = 100.0 if x is None else 0.001
    x = x or 0.0
    try:
        answer = rospy.ServiceProxy(node + '/query_box', QueryBox)(
            min=Point(x - reach, 0.01 - reach, 0.01 - reach), max=Point(x + reach, 0.01 + reach, 0.01 + reach))
    except rospy.ServiceException:
        return False
    return answer.occupancy == QueryBoxResponse.OCCUPIED


def nodes():
    """Names of all nodes that offer topics or services."""
    publishers, _, services = rospy.get_master().getSystemState()[2]
    return {name for _, names in publishers + services for name in names}


if __name__ == '__main__':
    rospy.init_node('test_sim_time')
    rostest.rosrun('cuboid_mapping', 'sim_time', SimTimeTest)
