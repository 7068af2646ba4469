# SPDX-License-Identifier: BSD-3-Clause
"""Base of tests that map messages with bag_to_map, and with a node."""
import csv
import pathlib
import subprocess
import tempfile
import unittest

import numpy as np
import rospy
from sensor_bags import make_camera, make_cloud, make_depth, make_tf, write_bag
from waiting import program, wait_for

from cuboid_mapping.srv import SaveMap

RESOLUTION_M = 0.1
STATIC = ('/tf_static', make_tf('map', 'lidar'), 0.0)
MOVING = [('/tf', make_tf('map', 'lidar', time_s), time_s) for time_s in np.arange(0.0, 5.1, 0.5)]
ROW = [(5.05, 0.05, 0.05), (5.05, 0.15, 0.05), (5.05, 0.25, 0.05), (5.05, 0.35, 0.05)]
WALL = np.full((2, 2), 2000, np.uint16)


def clouds(*messages):
    return [('/points', message, 1.0 + 0.1 * number) for number, message in enumerate(messages)]


def depth_of(depths, camera=None):
    camera = camera or make_camera(2, 2, 20.0)
    return [STATIC, ('/camera/camera_info', camera, 1.0), ('/camera/depth', make_depth(depths), 1.0)]


def read_voxels(file):
    """The centres of the occupied voxels of a .csv map, as sets of numbers with two decimals."""
    voxels = set()
    with open(file, encoding='utf-8') as stream:
        for row in csv.DictReader(stream):
            if row['class'] != 'occupied':
                continue
            low = np.array([float(row['min_' + axis]) for axis in 'xyz'])
            counts = np.rint((np.array([float(row['max_' + axis]) for axis in 'xyz']) - low) / RESOLUTION_M)
            for index in np.ndindex(*counts.astype(int)):
                center = low + (np.array(index) + 0.5) * RESOLUTION_M
                voxels.add(tuple(float(x) for x in np.round(center, 2) + 0.0))
    return voxels


class InputCase(unittest.TestCase):

    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory()
        self.folder = pathlib.Path(self.temporary.name)
        self.addCleanup(self.temporary.cleanup)

    def map_bags(self, *arguments, status=0):
        """Runs bag_to_map in the folder. Returns its output."""
        end = subprocess.run([program('bag_to_map'), *map(str, arguments)], cwd=self.folder,
                             capture_output=True, text=True)
        self.assertEqual(end.returncode, status, end.stderr)
        return end.stderr

    def map_records(self, records, *options, status=0):
        """Maps a bag of records with these options alone. Returns the output."""
        write_bag(self.folder / 'input.bag', records)
        return self.map_bags('input.bag', *options, '--set', f'resolution={RESOLUTION_M}', status=status)

    def voxels(self, name='input'):
        subprocess.run([program('map_convert'), f'{name}.cuboids', 'map.csv'], cwd=self.folder,
                       check=True, capture_output=True)
        return read_voxels(self.folder / 'map.csv')

    def expect_of_node(self, records, **parameters):
        """The node makes the same bytes from the messages as bag_to_map from their bag."""
        expected = (self.folder / 'input.cuboids').read_bytes()
        topic = [name for name, _, _ in records if not name.startswith('/tf') and 'camera_info' not in name][0]
        arguments = [f'_{key}:={value}' for key, value in {'resolution': RESOLUTION_M, **parameters}.items()]
        if rospy.has_param('/others'):
            rospy.delete_param('/others')  # From the previous node.
        node = subprocess.Popen([program('cuboid_mapping_node'), '__name:=others',
                                 f'cloud_in:={topic}', *arguments])
        try:
            rospy.wait_for_service('/others/save_map', 60.0)
            publishers = {}
            for name, message, _ in records:
                if name not in publishers:
                    publishers[name] = rospy.Publisher(name, type(message), queue_size=10, latch=True)
            for name, publisher in publishers.items():
                self.assertTrue(wait_for(lambda p=publisher: p.get_num_connections() > 0), name)
            for name, message, _ in records:
                publishers[name].publish(message)
                rospy.sleep(0.2)
            save = rospy.ServiceProxy('/others/save_map', SaveMap)

            def is_same():
                saved = save(str(self.folder / 'node.cuboids'))
                self.assertTrue(saved.info.success, saved.info.message)
                return (self.folder / 'node.cuboids').read_bytes() == expected

            self.assertTrue(wait_for(is_same, 10.0))
            for publisher in publishers.values():
                publisher.unregister()
        finally:
            node.terminate()
            node.wait()
