#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Messages whose description contradicts their data: bag_to_map takes the only reading that makes sense, or names the
setting that decides, and the node makes the same bytes."""
import math
import os

import numpy as np
import rospy
import rostest
from input_cases import ROW, STATIC, InputCase, clouds, depth_of
from sensor_bags import at, compress_depth, make_camera, make_cloud, make_depth, make_scan, make_tf
from tf2_msgs.msg import TFMessage

TURN_RAD_S = 2.0
STEEP = np.linspace(1500.0, 2500.0, 400).reshape(20, 20)  # Depths in millimetres.
CAMERA = make_camera(20, 20, 20.0)
TURNING = ('/tf', TFMessage([make_tf('map', 'lidar', time_s, rotation=(0.0, 0.0, math.sin(TURN_RAD_S * time_s / 2),
                                                                     math.cos(TURN_RAD_S * time_s / 2))).transforms[0]
                             for time_s in np.arange(0.0, 1.5, 0.005)]), 1.1)


def swapped(message):
    """The same numbers in the other byte order, with the old is_bigendian."""
    size = 8 if getattr(message, 'fields', None) and message.fields[0].datatype == 8 else 4
    size = 2 if getattr(message, 'encoding', '') == '16UC1' else size
    message.data = np.frombuffer(message.data, f'<u{size}').astype(f'>u{size}').tobytes()
    return message


def with_flag(message):
    message.is_bigendian = 1
    return message


def see_wall(field, kind, unit_s, offset_s=0.0, stamp_s=1.0):
    """A cloud of a wall at x = 5.05 m, measured in 0.1 s, while the sensor turns."""
    times_s = np.linspace(0.0, 0.0999, 400)
    angles = TURN_RAD_S * (stamp_s + times_s)
    y = np.linspace(-0.97, 0.98, 400)
    points = np.c_[np.cos(angles) * 5.05 + np.sin(angles) * y, np.cos(angles) * y - np.sin(angles) * 5.05, 0.0 * y + 0.05]
    numbers = (times_s + offset_s) / unit_s
    return make_cloud(points, stamp_s, times=(field, kind, np.rint(numbers) if 'u' in kind else numbers))


class ContradictionsTest(InputCase):

    def expect_same(self, records, expected, words, *options):
        """The map is that of the expected records, and the words are said once, or nothing is."""
        self.map_records(expected, *options)
        voxels = self.voxels()
        said = self.map_records(records, *options)
        self.assertEqual(self.voxels(), voxels)
        self.assertEqual(said.count(words) if words else 'warning' in said, 1 if words else 0, said)

    # Byte order.

    def test_byte_order_of_a_cloud(self):
        for kind in ('<f4', '<f8'):
            good = [STATIC] + clouds(make_cloud(ROW, kind=kind))
            wrong_flag = [STATIC] + clouds(with_flag(make_cloud(ROW, kind=kind)), with_flag(make_cloud(ROW, kind=kind)))
            self.expect_same(wrong_flag, good, 'is_bigendian is true')
            self.expect_node(wrong_flag)
            self.expect_same([STATIC] + clouds(swapped(make_cloud(ROW, kind=kind))), good, 'is_bigendian is false')
            self.expect_same([STATIC] + clouds(with_flag(swapped(make_cloud(ROW, kind=kind)))), good, '')

    def test_byte_order_of_a_depth_image(self):
        flat = np.full((20, 20), 2000, np.uint16)
        for depths in (STEEP.astype(np.uint16), flat, (STEEP / 1000).astype(np.float32)):
            good = depth_of(depths, CAMERA)
            wrong = good[:2] + [('/camera/depth', with_flag(make_depth(depths)), 1.0)]
            self.expect_same(wrong, good, 'is_bigendian is true')
            self.expect_same(good[:2] + [('/camera/depth', with_flag(swapped(make_depth(depths))), 1.0)], good, '')
        self.expect_node(wrong, type='depth_image')

    # Units.

    def test_whole_metres_of_a_depth_image_above_a_hundred_are_millimetres(self):
        good = depth_of(STEEP.astype(np.uint16), CAMERA)
        records = depth_of(STEEP.astype(np.uint16).astype(np.float32), CAMERA)
        self.expect_same(records, good, 'taken as millimetres')
        self.expect_node(records, type='depth_image')
        self.expect_same(records, good, '', '--set', 'length_unit=0.001')
        self.expect_same(records, good, 'is used for length_unit', '--set', 'depth_unit=0.001')
        every_second = STEEP.astype(np.uint16).astype(np.float32)
        every_second[::2] = np.nan
        self.assertIn('taken as millimetres', self.map_records(depth_of(every_second, CAMERA)))

    def test_depths_that_no_camera_measures_are_refused(self):
        for depths, unit in ((STEEP.astype(np.float32) + 0.25, 0.001), (STEEP.astype(np.float32) / 4 + 0.3, 0.004),
                             ((STEEP / 500).astype(np.uint16), 1.0)):
            records = depth_of(depths, CAMERA)
            self.assertIn('Set length_unit to their unit', self.map_records(records, status=1))
            self.map_records(records, '--set', f'length_unit={unit}')
            self.assertTrue(all(1.4 < z < 5.1 for _, _, z in self.voxels()))
        self.expect_node(records, type='depth_image', length_unit=1.0)

    def test_points_in_millimetres_are_refused(self):
        points = 1000.0 * np.array(ROW)
        for records, options in (([STATIC] + clouds(make_cloud(points)), {}),
                                 ([STATIC, ('/scan', make_scan([5000.0 + k for k in range(60)], range_max=30.0), 1.0)],
                                  {'type': 'laser_scan'}),
                                 ([STATIC, ('/scan', make_scan([5000.0 + k for k in range(60)], range_max=30000.0), 1.0)],
                                  {'type': 'laser_scan'})):
            self.assertIn('Set length_unit to its unit', self.map_records(records, status=1))
            self.map_records(records, '--set', 'length_unit=0.001')
            self.assertTrue(all(4.9 < np.hypot(x, y) < 5.2 for x, y, _ in self.voxels()))
            self.expect_node(records, length_unit=0.001, **options)

    def test_angles_of_a_scan_that_contradict_each_other(self):
        ranges = [4.0 + 0.005 * number for number in range(181)]
        good = make_scan(ranges)
        good.angle_min, good.angle_max, good.angle_increment = -math.pi / 2, math.pi / 2, math.pi / 180
        expected = [STATIC, ('/scan', good, 1.0)]
        for angles, words in (((-90.0, 90.0, 1.0), 'taken as degrees'),
                              ((-90.0, 90.0, good.angle_increment), 'taken as degrees'),
                              ((good.angle_min, good.angle_max, 1.0), 'from angle_min to angle_max'),
                              ((good.angle_min, good.angle_max, math.nan), 'from angle_min to angle_max'),
                              ((good.angle_min, 2 * good.angle_max, good.angle_increment), 'the increment counts'),
                              ((good.angle_min, good.angle_max, 0.0), 'from angle_min to angle_max')):
            scan = make_scan(ranges)
            scan.angle_min, scan.angle_max, scan.angle_increment = angles
            self.expect_same([STATIC, ('/scan', scan, 1.0)], expected, words)
        self.expect_node([STATIC, ('/scan', scan, 1.0)], type='laser_scan')

    def test_times_have_the_unit_that_makes_a_sweep(self):
        good = [TURNING, ('/points', see_wall('time', '<f4', 1.0), 1.2)]
        day_s = at(1.0).to_sec()
        for field, kind, unit_s, offset_s, words in (
                ('time', '<f4', 1e-3, 0.0, 'milliseconds'), ('time', '<f4', 1e-6, 0.0, 'microseconds'),
                ('offset_time', '<u4', 1e-6, 0.0, 'microseconds'), ('t', '<u4', 1e-3, 0.0, 'milliseconds'),
                ('t', '<u4', 1e-9, 0.0, ''), ('timestamp', '<f8', 1.0, day_s, ''),
                ('timestamp', '<f8', 1e-3, day_s, 'milliseconds'), ('timestamp', '<f8', 1e-6, day_s, 'microseconds'),
                ('timestamp', '<f8', 1e-9, day_s, 'nanoseconds')):
            records = [TURNING, ('/points', see_wall(field, kind, unit_s, offset_s), 1.2)]
            self.expect_same(records, good, words, '--set', 'deskew=true')
        self.expect_node(records, deskew='true')
        records[-1] = ('/points', see_wall('time', '<f4', 1e-3), 1.2)
        self.map_records(good, '--set', 'deskew=true')
        expected = self.voxels()
        self.assertNotIn('warning', self.map_records(records, '--set', 'deskew=true', 'time_unit=0.001'))
        self.assertEqual(self.voxels(), expected)

    def test_times_of_another_cloud_do_not_count(self):
        without = [TURNING, ('/points', see_wall('time', '<f4', 1.0), 1.2)]
        self.map_records(without)
        expected = self.voxels()
        for field, kind, offset_s in (('time', '<f4', 37.0), ('timestamp', '<f8', at(-40.0).to_sec()),
                                      ('timestamp', '<f4', at(1.0).to_sec()), ('t', '<u4', 3.0)):
            unit_s = 1e-9 if kind == '<u4' else 1.0
            records = [TURNING, ('/points', see_wall(field, kind, unit_s, offset_s), 1.2)]
            said = self.map_records(records, '--set', 'deskew=true')
            self.assertEqual(said.count('are ignored'), 1, said)
            self.assertEqual(self.voxels(), expected)

    def test_limits_of_a_scan_that_were_left_unset_do_not_count(self):
        ranges = [4.0 + 0.005 * number for number in range(181)]
        unset = [STATIC, ('/scan', make_scan(ranges, range_max=0.0), 1.0)]
        self.expect_same(unset, [STATIC, ('/scan', make_scan(ranges), 1.0)], 'taken as unset')
        self.expect_node(unset, type='laser_scan')

    def test_a_principal_point_that_was_left_unset_is_the_middle(self):
        good = depth_of(STEEP.astype(np.uint16), CAMERA)
        camera = make_camera(20, 20, 20.0)
        camera.K[2] = camera.K[5] = camera.P[2] = camera.P[6] = 0.0
        unset = depth_of(STEEP.astype(np.uint16), camera)
        self.expect_same(unset, good, 'the middle of the image is taken')
        self.expect_node(unset, type='depth_image')

    def test_a_focal_length_that_is_not_in_pixels_is_refused(self):
        good = depth_of(STEEP.astype(np.uint16), CAMERA)
        for focal_length in (0.9, -0.9, 1e-3):
            good[1] = (good[1][0], make_camera(20, 20, focal_length), 1.0)
            self.assertIn('in an image 20 wide', self.map_records(good, status=1))

    def test_an_image_is_of_depths_if_the_type_says_so(self):
        good = depth_of(STEEP.astype(np.uint16), CAMERA)
        other = depth_of(STEEP.astype(np.uint16), CAMERA)
        other[-1] = ('/camera/image', make_depth(STEEP.astype(np.uint16)), 1.0)
        other[-1][1].encoding = 'mono16'
        self.assertIn('cannot be mapped', self.map_records(other, '--topic', '/camera/image', status=1))
        self.expect_same(other, good, '', '--set', 'type=depth_image')
        both = good + [('/camera/image', other[-1][1], 1.5)]
        expected = self.voxels()
        self.map_records(both, '--set', 'type=depth_image', '--topic', '/camera/image')
        self.assertEqual(self.voxels(), expected)
        other[-1][1].encoding = '64FC1'
        self.assertIn("its encoding is '64FC1'", self.map_records(other, '--set', 'type=depth_image', status=1))

    # Layouts.

    def test_a_cloud_of_no_columns_or_rows_has_one(self):
        for size in ({'width': 0, 'height': len(ROW)}, {'width': len(ROW), 'height': 0}):
            records = [STATIC] + clouds(make_cloud(ROW, **size))
            self.map_records(records)
            self.assertEqual(self.voxels(), set(ROW))

    def test_data_of_more_points_than_the_cloud_has_is_named(self):
        few = [STATIC] + clouds(make_cloud(ROW[:2]))
        records = [STATIC] + clouds(make_cloud(ROW, width=2, row_step=24))
        self.expect_same(records, few, 'the rest is left out')

    def test_a_point_step_within_the_fields_is_that_of_the_data(self):
        for step in (0, 4, 11):
            records = [STATIC] + clouds(make_cloud(ROW, point_step=step))
            self.map_records(records)
            self.assertEqual(self.voxels(), set(ROW))
        self.expect_node(records)

    def test_fields_that_are_not_those_of_the_data_are_refused(self):
        same, doubles = make_cloud(ROW), make_cloud(ROW, kind='<f8')
        for cloud, name, value, words in ((same, 'offset', 0, 'fields x and y overlap'),
                                          (doubles, 'datatype', doubles.fields[0].FLOAT32, 'can be no lengths')):
            for field in cloud.fields:
                setattr(field, name, value)
            self.assertIn(words, self.map_records([STATIC] + clouds(cloud), status=1))

    def test_a_format_of_png_alone_is_read(self):
        good = depth_of(STEEP.astype(np.uint16), CAMERA)
        for transport in ('compressedDepth', 'compressed'):
            for depths, format_ in ((STEEP.astype(np.uint16), 'png'), (STEEP.astype(np.uint16), ''),
                                    (STEEP.astype(np.uint16), '16UC1; compressedDepth'),
                                    (STEEP.astype(np.uint16), '16UC1; png compressed')):
                message = compress_depth(make_depth(depths), transport)
                message.format = format_
                records = good[:2] + [(f'/camera/depth/{transport}', message, 1.0)]
                self.expect_same(records, good, '')
        self.expect_node(records, type='depth_image')
        metres = (STEEP / 1000).astype(np.float32)
        message = compress_depth(make_depth(metres))
        whole = good[:2] + [('/camera/depth/compressedDepth', compress_depth(make_depth(metres)), 1.0)]
        message.format = 'png'
        self.expect_same(good[:2] + [('/camera/depth/compressedDepth', message, 1.0)], whole, '')

    def expect_node(self, records, **parameters):
        """As expect_of_node(), with the clouds at the end, when the node has the transforms."""
        self.expect_of_node(sorted(records, key=lambda record: not record[0].startswith('/tf')), **parameters)


if __name__ == '__main__':
    os.environ['PYTHONUNBUFFERED'] = '1'
    rospy.init_node('contradictions')
    rostest.rosrun('cuboid_mapping', 'contradictions', ContradictionsTest)
