#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Launch files that set /use_sim_time reset it when they end."""
import os
import pathlib
import signal
import subprocess
import sys
import time
import unittest

import rospy
import rostest
from waiting import wait_for

PROGRAM = pathlib.Path(__file__).resolve().parents[2] / 'python/forget_sim_time'


class SimTimeTest(unittest.TestCase):

    def test_the_master_is_left_as_it_was(self):
        self.assertFalse(rospy.has_param('/use_sim_time'))
        launch = subprocess.Popen(
            ['roslaunch', 'cuboid_mapping', 'demo.launch', 'rviz:=false'], start_new_session=True)
        try:
            self.assertTrue(wait_for(lambda: '/forget_sim_time' in nodes()))
            self.assertTrue(rospy.get_param('/use_sim_time'))
        finally:
            launch.send_signal(signal.SIGINT)
            launch.wait()
        self.assertFalse(rospy.has_param('/use_sim_time'))

    def test_help_needs_no_master(self):
        nobody = {**os.environ, 'ROS_MASTER_URI': 'http://localhost:1'}
        answer = subprocess.run([sys.executable, PROGRAM, '--help'], env=nobody, timeout=20, check=True, stdout=subprocess.PIPE)
        self.assertIn(b'/use_sim_time', answer.stdout)

    def test_it_ends_whenever_it_is_stopped(self):
        for delay_s in (0.0, 0.001, 0.002, 0.005, 0.01):  # rospy is still starting.
            self.assertTrue(wait_for(lambda: '/forget_sim_time' not in nodes()))
            rospy.set_param('/use_sim_time', True)
            node = subprocess.Popen([sys.executable, PROGRAM])
            try:
                self.assertTrue(wait_for(lambda: '/forget_sim_time' in nodes()))
                time.sleep(delay_s)
                node.send_signal(signal.SIGINT)
                node.wait(timeout=20)
                self.assertFalse(rospy.has_param('/use_sim_time'))
            finally:
                node.kill()


def nodes():
    """Names of all nodes that offer topics or services."""
    publishers, _, services = rospy.get_master().getSystemState()[2]
    return {name for _, names in publishers + services for name in names}


if __name__ == '__main__':
    rospy.init_node('test_sim_time')
    rostest.rosrun('cuboid_mapping', 'sim_time', SimTimeTest)
