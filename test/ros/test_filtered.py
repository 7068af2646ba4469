#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""filtered.launch: a recorded lidar through the nodelets of pcl_ros into the map, beside the same clouds without them."""
import os
import pathlib
import unittest
import xmlrpc.client

import numpy as np
import rosbag
import rospy
import rostest
from sensor_msgs.msg import PointCloud2
from waiting import wait_for

from cuboid_mapping.srv import GetCuboids, GetCuboidsRequest

BAG = pathlib.Path(os.environ.get('CUBOID_DATA_DIR', '/nowhere')) / 'bag_ouster_os1/ouster.bag'
EDGE_M = 0.2


def occupied_voxels(node):
    answer = rospy.ServiceProxy(node + '/get_cuboids', GetCuboids)(everything=True, classes=GetCuboidsRequest.OCCUPIED)
    voxels = set()
    for cuboid in answer.cuboids:
        low, high = (np.rint(np.array([p.x, p.y, p.z]) / EDGE_M).astype(int) for p in (cuboid.min, cuboid.max))
        voxels |= {(x, y, z) for x in range(low[0], high[0]) for y in range(low[1], high[1]) for z in range(low[2], high[2])}
    return voxels


def is_near(voxel):
    """Whether a voxel lies within the box of the robot."""
    return all(-0.5 <= EDGE_M * i and EDGE_M * (i + 1) <= 0.5 for i in voxel)


@unittest.skipUnless(BAG.exists(), 'CUBOID_DATA_DIR has no recorded lidar')
class FilteredTest(unittest.TestCase):

    def test_noise_is_left_out_and_nothing_comes_in(self):
        for node in ('/cuboid_mapping', '/plain/cuboid_mapping'):
            rospy.wait_for_service(node + '/get_cuboids', 60.0)
        publisher = rospy.Publisher('/points', PointCloud2, queue_size=10)
        self.assertTrue(wait_for(lambda: publisher.get_num_connections() == 2))
        with rosbag.Bag(BAG) as bag:
            clouds = [message for _, message, _ in bag.read_messages(topics=['/ouster/points'])]
        self.assertGreaterEqual(len(clouds), 3)
        for cloud in clouds:  # One after the other: no queue overflows.
            before = occupied_voxels('/cuboid_mapping'), occupied_voxels('/plain/cuboid_mapping')
            publisher.publish(cloud)
            self.assertTrue(wait_for(lambda: occupied_voxels('/cuboid_mapping') != before[0] and
                                     occupied_voxels('/plain/cuboid_mapping') != before[1], 120.0))
        filtered, plain = occupied_voxels('/cuboid_mapping'), occupied_voxels('/plain/cuboid_mapping')
        self.assertGreater(len(plain), 1000)
        self.assertFalse(any(map(is_near, filtered)))
        self.assertLess(len(filtered), len(plain))
        self.assertGreater(len(filtered), 0.8 * len(plain))
        # A point ends a beam in both maps, or is noise. Few voxels differ where a beam of noise no longer clears.
        self.assertLess(len(filtered - plain), 0.01 * len(plain))

    def test_clouds_pass_between_the_nodelets_without_a_copy(self):
        rospy.wait_for_service('/cuboid_mapping/get_cuboids', 60.0)
        for topic in ('/crop_robot/output', '/remove_outliers/output'):
            self.assertTrue(wait_for(lambda: topic in self.transports(), 20.0), self.transports())
            self.assertEqual(self.transports()[topic], {'INTRAPROCESS'})

    @staticmethod
    def transports():
        """How the manager receives its topics."""
        uri = rospy.get_master().lookupNode('/filter_manager')[2]
        ways = {}
        for _, _, direction, transport, topic, *_ in xmlrpc.client.ServerProxy(uri).getBusInfo('/test_filtered')[2]:
            if direction == 'i':
                ways.setdefault(topic, set()).add(transport)
        return ways


if __name__ == '__main__':
    rospy.init_node('test_filtered')
    rostest.rosrun('cuboid_mapping', 'filtered', FilteredTest)
