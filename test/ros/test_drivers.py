#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The launch files map what common drivers publish."""
import pathlib
import struct
import unittest

import rospy
import rostest
from geometry_msgs.msg import Point, TransformStamped
from sensor_msgs import point_cloud2
from sensor_msgs.msg import CameraInfo, Image, LaserScan, PointField
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage

from cuboid_mapping.srv import GetMap, QueryBox, QueryBoxResponse


def make_field(name, offset, datatype=PointField.FLOAT32):
    return PointField(name=name, offset=offset, datatype=datatype, count=1)


XYZ = [make_field('x', 0), make_field('y', 4), make_field('z', 8)]
# Fields of the drivers after x, y and z.
VELODYNE = XYZ + [make_field('intensity', 12), make_field('ring', 16, PointField.UINT16),
                  make_field('time', 18)]
OUSTER = XYZ + [make_field('intensity', 16), make_field('t', 20, PointField.UINT32),
                make_field('reflectivity', 24, PointField.UINT16),
                make_field('ring', 26, PointField.UINT8)]
LIVOX = XYZ + [make_field('intensity', 12), make_field('tag', 16, PointField.UINT8),
               make_field('line', 17, PointField.UINT8)]


class DriversTest(unittest.TestCase):

    def check(self, node, topic, fields, limits_m, frame='map'):
        """A point nearer than the range limit is mapped; one beyond it and one on the robot are not."""
        min_range_m, max_range_m = limits_m
        inside, beyond, robot = 0.8 * max_range_m, 1.2 * max_range_m, 0.6 * min_range_m
        padding = [0] * (len(fields) - 3)
        self.publish(node, topic, point_cloud2.create_cloud(
            Header(frame_id=frame, stamp=rospy.Time(100.0)), fields,
            [[inside, 0.01, 0.01] + padding, [0.01, beyond, 0.01] + padding,
             [0.01, 0.01, robot] + padding]))
        self.expect_occupied(node, inside)
        self.assertFalse(self.is_occupied(node, 0.01, beyond, 0.01))
        self.assertEqual(self.is_occupied(node, 0.01, 0.01, robot), min_range_m == 0.0)

    @staticmethod
    def publish(node, topic, message):
        rospy.wait_for_service(node + '/query_box', 60.0)
        publisher = rospy.Publisher(topic, type(message), queue_size=1, latch=True)
        publisher.publish(message)

    def expect_occupied(self, node, x, y=0.01, z=0.01):
        deadline = rospy.get_time() + 60.0
        while rospy.get_time() < deadline and not self.is_occupied(node, x, y, z):
            rospy.sleep(0.1)
        self.assertTrue(self.is_occupied(node, x, y, z))

    def edge_of(self, node):
        """Edge length of a voxel in metres."""
        return rospy.ServiceProxy(node + '/get_map', GetMap)().map.resolution

    def is_occupied(self, node, x, y, z):
        margin_m = 0.001
        answer = rospy.ServiceProxy(node + '/query_box', QueryBox)(
            min=Point(x - margin_m, y - margin_m, z - margin_m),
            max=Point(x + margin_m, y + margin_m, z + margin_m))
        self.assertTrue(answer.success, answer.message)
        return answer.occupancy == QueryBoxResponse.OCCUPIED

    def test_velodyne(self):
        self.check('/velodyne/cuboid_mapping', '/velodyne_points', VELODYNE, (1.0, 50.0))
        self.assertAlmostEqual(self.edge_of('/velodyne/cuboid_mapping'), 0.2)

    def test_ouster_in_the_manager_of_the_driver(self):
        self.check('/ouster/cuboid_mapping', '/ouster/points', OUSTER, (1.0, 50.0))

    def test_livox_as_a_nodelet(self):
        self.check('/livox/cuboid_mapping', '/livox/lidar', LIVOX, (0.5, 50.0))

    def test_realsense(self):
        """The driver's depth image is mapped, which it sends without further settings."""
        node, focal_length, middle = '/realsense/cuboid_mapping', 50.0, 31.9
        header = Header(frame_id='map', stamp=rospy.Time(100.0))
        camera = CameraInfo(header=header, width=64, height=64,
                            K=[focal_length, 0, middle, 0, focal_length, middle, 0, 0, 1])
        image = Image(header=header, width=64, height=64, encoding='16UC1', step=128)
        depths_mm = [0] * (64 * 64)
        depths_mm[64 * 32 + 32] = 3210
        depths_mm[64 * 32 + 52] = 4810  # Beyond max_range.
        depths_mm[64 * 32 + 12] = 110  # On the robot.
        image.data = struct.pack('<4096H', *depths_mm)
        self.publish(node, '/camera/depth/camera_info', camera)
        self.publish(node, '/camera/depth/image_rect_raw', image)
        self.expect_occupied(node, 0.01, 0.01, 3.21)
        self.assertFalse(self.is_occupied(node, 1.93, 0.01, 4.81))
        self.assertFalse(self.is_occupied(node, -0.04, 0.01, 0.11))

    def test_laser(self):
        scan = LaserScan(header=Header(frame_id='map', stamp=rospy.Time(100.0)), angle_min=0.0, angle_max=0.01,
                         angle_increment=0.01, range_min=0.1, range_max=40.0, ranges=[20.01, 20.01])
        self.publish('/laser/cuboid_mapping', '/laser/scan', scan)
        self.expect_occupied('/laser/cuboid_mapping', 20.01)

    def test_what_is_remapped_and_set_around_the_file(self):
        node = '/remapped/cuboid_mapping'
        transform = TransformStamped(header=Header(frame_id='map'), child_frame_id='lidar')
        transform.transform.rotation.w = 1.0
        self.publish(node, '/robot/tf_static', TFMessage([transform]))
        self.check(node, '/remapped/points', XYZ, (0.0, 30.0), frame='lidar')
        self.assertAlmostEqual(self.edge_of(node), 0.3)

    def test_sensors(self):
        self.check('/sensors/cuboid_mapping', '/points', XYZ, (0.5, 20.0), frame='rear')
        self.assertAlmostEqual(self.edge_of('/sensors/cuboid_mapping'), 0.05)

    def test_window(self):
        self.check('/window/cuboid_mapping', '/window/cloud_in', XYZ, (1.0, 50.0))
        file = pathlib.Path(rospy.get_param('/window/cuboid_mapping/window/file'))
        self.assertEqual(file.read_bytes()[:15], b'SQLite format 3')
        for part in file.parent.glob(file.name + '*'):
            part.unlink()

    def test_octomap_server_has_its_own_defaults(self):
        node = '/compat/octomap_server'
        self.publish(node, '/compat/cloud_in', point_cloud2.create_cloud(
            Header(frame_id='map', stamp=rospy.Time(100.0)), XYZ, [[70.01, 0.01, 0.01]]))
        self.expect_occupied(node, 70.01)
        self.assertAlmostEqual(self.edge_of(node), 0.05)


if __name__ == '__main__':
    rospy.init_node('drivers')
    rostest.rosrun('cuboid_mapping', 'drivers', DriversTest)
