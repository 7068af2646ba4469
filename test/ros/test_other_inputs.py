#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Unusual inputs of sensors and bags: bag_to_map maps them, and the node makes the same bytes."""
import os

import numpy as np
import rosbag
import rospy
import rostest
from input_cases import MOVING, RESOLUTION_M, ROW, STATIC, WALL, InputCase, clouds, depth_of
from sensor_bags import at, compress_depth, make_camera, make_cloud, make_depth, make_scan, make_tf, write_bag


def scan_of(*ranges):
    return [STATIC, ('/scan', make_scan(list(ranges)), 1.0)]


class OtherInputsTest(InputCase):

    # Points without return.

    def test_range_max_is_no_return(self):
        records = scan_of(*[3.0, 10.0, 11.0, 10.5] * 9)
        self.map_records(records)
        self.assertTrue(all(np.hypot(x, y) < 4.0 for x, y, _ in self.voxels()))
        self.expect_of_node(records, type='laser_scan')

    def test_named_values_are_no_returns(self):
        records = scan_of(*[3.0, 8.19] * 20)
        said = self.map_records(records, '--set', 'sensor_model/no_return_points=rep_117 8.19',
                                'sensor_model/no_return_range=5')
        self.assertTrue(all(np.hypot(x, y) < 4.0 for x, y, _ in self.voxels()))
        self.assertNotIn('8.19 m', said)
        self.map_records(clouds(make_cloud(ROW + [(0.0, 30.0, 40.0)])) + [STATIC], '--set',
                         'sensor_model/no_return_points=none 50')
        self.assertEqual(self.voxels(), set(ROW))
        self.map_records(depth_of(np.array([[2000, 65535], [65534, 7000]], np.uint16)), '--set',
                         'sensor_model/no_return_points=none 65534 7')
        self.assertEqual(len(self.voxels()), 1)

    def test_one_range_of_a_tenth_of_the_points_is_named(self):
        ranges = [3.0 + 0.01 * number for number in range(180)] + [8.19] * 20
        said = self.map_records(scan_of(*ranges))
        self.assertIn('10 % of the points have one range, 8.19 m', said)
        self.assertIn('no_return_points: "rep_117 8.19"', said)

    def test_depths_in_another_unit_are_noticed(self):
        depths = (2000 * np.linspace(4.0, 8.0, 400)).astype(np.uint16).reshape(20, 20)
        records = depth_of(depths, make_camera(20, 20, 20.0))
        said = self.map_records(records)
        self.assertIn('length_unit', said)
        said = self.map_records(records, '--set', 'sensor_model/max_range=5')
        self.assertIn('beyond sensor_model/max_range', said)
        self.assertIn('nothing in the map is occupied', said)
        said = self.map_records(records, '--set', 'length_unit=0.0002')
        self.assertNotIn('length_unit', said)
        self.assertTrue(all(z < 3.5 for _, _, z in self.voxels()))
        self.expect_of_node([records[0], records[2], records[1]], type='depth_image', length_unit=0.0002)

    def test_a_negative_focal_length_is_noticed(self):
        camera = make_camera(2, 2, 20.0)
        camera.P = camera.P[:5] + (-20.0,) + camera.P[6:] if isinstance(camera.P, tuple) else \
            camera.P[:5] + [-20.0] + camera.P[6:]
        self.assertIn('negative focal length', self.map_records(depth_of(WALL, camera)))

    # A single bad element.

    def test_a_point_of_an_odd_time_is_left_out(self):
        for times, points in [([0, 3604361924], ROW[:2]), ([0, 0xFFFFFFFF], [ROW[0], (np.nan,) * 3])]:
            records = MOVING + clouds(make_cloud(points, times_ns=times))
            said = self.map_records(records, '--set', 'deskew=true')
            self.assertEqual(self.voxels(), {ROW[0]})
            self.assertEqual('1 point left out' in said, points == ROW[:2], said)
        self.expect_of_node(records, deskew='true')

    def test_garbage_leads_no_other_point(self):
        points = [(1e9, -1e12, 1e20), *[(5.05, 0.05 + 0.1 * number, 0.05) for number in range(20)]]
        records = clouds(make_cloud(points, kind='<f8')) + [STATIC]
        self.map_records(records, '--set', 'sensor_model/max_range=100')
        self.assertEqual(self.voxels(), {tuple(np.round(point, 2)) for point in points[1:]})

    def test_points_cut_off_by_a_limit_and_the_way_of_the_sensor_are_named(self):
        high = [(x, y, 3.05) for x, y, _ in ROW]
        moving = [('/tf', make_tf('map', 'lidar', time_s, position=(time_s, 0.0, 1.5)), time_s) for time_s in (0.0, 5.0)]
        said = self.map_records(clouds(make_cloud(ROW + high)) + moving, '--set', 'pointcloud_max_z=2', 'tf_gap=10')
        self.assertIn('50 % of the points left out by sensor_model/min_range, pointcloud_min_*', said)
        self.assertRegex(said, r'the sensor moved from \([\d.]+, 0, 1\.5\) to ')

    def test_points_in_a_far_frame_are_named(self):
        far = np.array(ROW * 30) + (466880.0, 5572094.0, 330.0)
        said = self.map_records(clouds(make_cloud(far, kind='<f8')) + [STATIC])
        self.assertIn('more than 6553.5 m from the start of their beams', said)
        self.assertIn('sensor_frame', said)
        self.assertIn('120 were too far', said)

    def test_a_cloud_without_a_frame_is_called_so(self):
        said = self.map_records([STATIC] + clouds(make_cloud(ROW, frame='')), status=1)
        self.assertIn('empty frame_id: set the frame', said)
        self.assertNotIn('Nobody publishes', said)

    # A single reading.

    def test_a_row_step_of_the_whole_cloud_or_none_has_one_reading(self):
        for description in [{'row_step': 48}, {'row_step': 0}, {'row_step': 7}]:
            records = [STATIC] + clouds(make_cloud(ROW, width=2, height=2, **description))
            self.map_records(records)
            self.assertEqual(self.voxels(), set(ROW), description)
        self.expect_of_node(records)
        for description in [{'height': 0}, {'point_step': 0}]:
            self.map_records([STATIC] + clouds(make_cloud(ROW, **description)))
            self.assertEqual(self.voxels(), set(ROW), description)

    def test_transforms_of_a_robot_are_found(self):
        records = [('/r1' + STATIC[0], *STATIC[1:])] + clouds(make_cloud(ROW))
        self.assertIn('/r1/tf_static', self.map_records(records))
        self.assertEqual(self.voxels(), set(ROW))
        records += [('/r2/tf_static', make_tf('map', 'lidar', position=(0.0, 0.0, 1.0)), 0.0)]
        said = self.map_records(records, status=1)
        self.assertIn('/r1/tf, /r2/tf', said)
        self.map_records(records, '--tf', '/r2')
        self.assertEqual(self.voxels(), {(x, y, 1.05) for x, y, _ in ROW})

    # Two descriptions.

    def test_a_camera_info_of_another_size_is_refused(self):
        said = self.map_records(depth_of(WALL, make_camera(8, 8, 20.0)), status=1)
        self.assertIn('2 x 2', said)
        self.assertIn('8 x 8', said)

    def test_a_quaternion_of_two_digits_is_a_rotation(self):
        for rotation in [(0.0, 0.0, 0.71, 0.71), (0.0, 0.0, 0.7, 0.7)]:
            records = [('/tf_static', make_tf('map', 'lidar', rotation=rotation), 0.0)] + \
                clouds(make_cloud([(50.05, -0.05, 0.05)]))
            self.map_records(records)
            self.assertEqual(self.voxels(), {(0.05, 50.05, 0.05)})
        self.expect_of_node(records)

    def test_a_pcd_of_doubles_is_read(self):
        (self.folder / 'doubles/pcd').mkdir(parents=True)
        (self.folder / 'doubles/pcd/0.pcd').write_text(
            'VERSION .7\nFIELDS x y z\nSIZE 8 8 8\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 1\nHEIGHT 1\n'
            'VIEWPOINT 5572094.15 466880.25 330 1 0 0 0\nPOINTS 1\nDATA ascii\n5572099.15 466880.25 330.05\n')
        self.map_bags('doubles', '--set', f'resolution={RESOLUTION_M}')
        self.assertEqual(self.voxels('doubles'), {(5572099.15, 466880.25, 330.05)})

    def test_a_pcd_that_pcl_would_misread_is_refused(self):
        def map_pcd(header, rows, status=0):
            folder = self.folder / 'cloud/pcd'
            folder.mkdir(parents=True, exist_ok=True)
            (folder / '0.pcd').write_text(header + ''.join(row + '\n' for row in rows), encoding='utf-8')
            return self.map_bags('cloud', '--set', f'resolution={RESOLUTION_M}', status=status)

        header = 'FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 4\nHEIGHT 1\nPOINTS 4\nDATA ascii\n'
        rows = [' '.join(map(str, point)) for point in ROW]
        map_pcd('# .PCD v0.7\n\nVERSION .7\n' + header, rows)
        self.assertEqual(self.voxels('cloud'), set(ROW))
        self.assertIn('line 5 is not one of a PCD header', map_pcd(header.replace('WIDTH', 'AUTHOR me\nWIDTH'), rows, 1))
        self.assertIn('line 1 is not one of a PCD header', map_pcd('\ufeff# .PCD\n' + header, rows, 1))
        self.assertIn('line 1 is not one of a PCD header', map_pcd('ply\n', rows, 1))
        self.assertIn('COUNT is negative', map_pcd(header.replace('COUNT 1 1', 'COUNT 1 -1'), rows, 1))
        self.assertIn('no DATA', map_pcd('', [], 1))
        decimals = rows[:1] + [row.replace('.', ',') for row in rows[1:]]
        self.assertIn('point 2 must be 3 numbers with decimal points', map_pcd(header, decimals, 1))
        self.assertIn('point 1 must be 3 numbers', map_pcd(header, [row + ' 7' for row in rows], 1))
        self.assertIn('its POINTS are 4, but it has 5', map_pcd(header, rows + rows[:1], 1))
        (self.folder / 'cloud/pcd/0.pcd').unlink()
        os.mkfifo(self.folder / 'cloud/pcd/0.pcd')
        self.assertIn('there is no such file', self.map_bags('cloud', status=1))

    # Changes during a recording.

    def test_static_transforms_that_contradict_each_other_are_named(self):
        with rosbag.Bag(self.folder / 'statics.bag', 'w') as bag:
            for number, (publisher, up_m) in enumerate((('/one', 0.0), ('/one', 1.0), ('/two', 1.0), ('/two', 3.0))):
                message = make_tf('map', 'lidar', position=(0.0, 0.0, up_m))
                header = {'topic': '/tf_static', 'type': message._type, 'md5sum': message._md5sum, 'latching': '1',
                          'message_definition': message._full_text, 'callerid': publisher}
                bag.write('/tf_static', message, at(0.1 * number), connection_header=header)
                bag._topic_connections.pop('/tf_static')  # A connection for each publisher.
            bag.write('/points', make_cloud(ROW), at(1.0))
        said = self.map_bags('statics.bag')
        self.assertEqual(said.count("'lidar' has different static transforms from /one and /two"), 1, said)

    def test_a_static_transform_holds_until_the_next(self):
        first = clouds(make_cloud(ROW))
        moved = ('/tf_static', make_tf('map', 'lidar', 3.0, (0.0, 0.0, 2.0)), 3.0)
        records = [STATIC] + first + [moved, ('/points', make_cloud(ROW, 4.0), 4.0)]
        self.map_records(records)
        both = set(ROW) | {(x, y, 2.05) for x, y, _ in ROW}
        self.assertEqual(self.voxels(), both)
        self.expect_of_node(records)
        write_bag(self.folder / 'a.bag', records[:2])
        write_bag(self.folder / 'b.bag', records[2:])
        self.map_bags('b.bag', 'a.bag', '-o', 'two.cuboids', '--set', f'resolution={RESOLUTION_M}')
        self.assertEqual(self.voxels('two'), both)

    def test_a_topic_can_mark_with_a_crop_and_clear_without(self):
        beyond = [make_cloud([(4.1, 0.1, 0.22)], 2.0 + number) for number in range(3)]
        records = [STATIC] + clouds(make_cloud([(2.05, 0.05, 0.11)]), *beyond)
        self.map_records(records, '--set', 'pointcloud_max_x=3')
        self.assertEqual(self.voxels(), {(2.05, 0.05, 0.15)})
        self.map_records(records, '--set', 'sources=[{name: marks, topic: /points, use: mark, pointcloud_max_x: 3.0}, '
                         '{name: clears, topic: /points, use: clear}]')
        self.assertEqual(self.voxels(), set())

    # Unreadable messages.

    def test_a_broken_chunk_costs_its_own_messages_alone(self):
        records = [STATIC] + [('/points', make_cloud(np.tile([(5.05, 0.05 + 0.1 * k, 0.05)], (2000, 1)) +
                                                     np.random.RandomState(k).uniform(-0.02, 0.02, (2000, 3)),
                                                     1.0 + k), 1.0 + k) for k in range(20)]
        for compression in ('none', 'bz2', 'lz4'):
            file = self.folder / 'input.bag'
            write_bag(file, records, compression=compression, chunk_threshold=48000)
            content = bytearray(file.read_bytes())
            middle = len(content) // 2
            content[middle:middle + 64] = bytes(64)
            file.write_bytes(content)
            said = self.map_bags('input.bag', '--set', f'resolution={RESOLUTION_M}')
            num_occupied = len(self.voxels())
            self.assertGreaterEqual(num_occupied, 17, compression)
            if compression != 'none':
                self.assertRegex(said, r'input\.bag is damaged: \d messages? from [\d.]+ to [\d.]+ s after its start')

    def test_a_bag_without_an_index_says_how_to_make_one(self):
        write_bag(self.folder / 'whole.bag', [STATIC] + clouds(make_cloud(ROW)))
        content = (self.folder / 'whole.bag').read_bytes()
        header = content.index(b'index_pos=') + len(b'index_pos=')
        (self.folder / 'cut.bag.active').write_bytes(content[:header] + bytes(8) + content[header + 8:])
        self.assertIn('rosbag reindex cut.bag.active', self.map_bags('cut.bag.active', status=1))

    def test_messages_of_another_definition_are_named(self):
        write_bag(self.folder / 'other.bag', [STATIC] + clouds(make_cloud(ROW)))
        with rosbag.Bag(self.folder / 'other.bag', 'a') as bag:
            message = make_cloud(ROW)
            bag.write('/points', message, at(2.0), connection_header={
                'topic': '/points', 'type': message._type, 'md5sum': 32 * '0', 'message_definition': message._full_text})
        said = self.map_bags('other.bag', '--set', f'resolution={RESOLUTION_M}')
        self.assertIn('1 message from 2 to 2 s', said)
        self.assertIn('sensor_msgs/PointCloud2 has another definition there: try rosbag fix', said)
        self.assertEqual(self.voxels('other'), set(ROW))

    def test_a_file_that_is_no_rosbag_of_ros_1_is_called_so(self):
        (self.folder / 'new.mcap').write_bytes(b'\x89MCAP0\r\n')
        self.assertIn('rosbags-convert', self.map_bags('new.mcap', status=1))
        os.mkfifo(self.folder / 'pipe.bag')
        self.assertIn('a device or a pipe', self.map_bags('pipe.bag', status=1))

    def test_repeated_transforms_are_said_once(self):
        records = MOVING * 50 + clouds(make_cloud(ROW))
        said = self.map_records(records)
        self.assertEqual(said.count('TF_REPEATED_DATA'), 2, said)  # In the kind, and in the first text of tf.
        self.assertIn(f'{49 * len(MOVING)} transforms left out', said)

    # Kinds of input.

    def test_the_topic_and_its_type_are_found(self):
        said = self.map_records(scan_of(*[3.0] * 90))
        self.assertIn('takes /scan (sensor_msgs/LaserScan, 1 message, frame \'lidar\')', said)
        self.assertNotIn('left out', said)
        said = self.map_records(depth_of(WALL))
        self.assertIn('takes /camera/depth (sensor_msgs/Image', said)
        records = scan_of(*[3.0] * 90) + clouds(make_cloud(ROW))
        said = self.map_records(records)
        self.assertIn('takes /points', said)
        self.assertIn('leaves /scan (sensor_msgs/LaserScan', said)
        self.assertEqual(self.voxels(), set(ROW))
        self.map_records(records, '--topic', '/points', '/scan')
        self.assertGreater(len(self.voxels()), len(ROW))
        said = self.map_records(scan_of(3.0), '--set', 'type=point_cloud', status=1)
        self.assertIn('--topic /scan --set type=laser_scan', said)
        said = self.map_records([STATIC], status=1)
        self.assertIn('/tf_static', said)

    def test_a_topic_has_the_type_of_most_of_its_messages(self):
        write_bag(self.folder / 'good.bag', [STATIC] + clouds(make_cloud(ROW), make_cloud(ROW, 1.1)))
        write_bag(self.folder / 'other.bag', [('/points', make_scan([3.0]), 2.0)])
        for bags in (('good.bag', 'other.bag'), ('other.bag', 'good.bag')):
            self.map_bags(*bags, '-o', 'both.cuboids', '--set', f'resolution={RESOLUTION_M}')
            self.assertEqual(self.voxels('both'), set(ROW))

    def test_compressed_depth_images_give_the_map_of_the_images(self):
        depths = np.arange(1, 65536, 163, np.uint16)[:400].reshape(20, 20)  # Of all sizes.
        records = depth_of(depths, make_camera(20, 20, 20.0))
        self.map_records(records)
        expected = (self.folder / 'input.cuboids').read_bytes()
        for transport in ('compressedDepth', 'compressed'):
            topic = f'/camera/depth/{transport}'
            compressed = records[:2] + [(topic, compress_depth(records[2][1], transport), 1.0)]
            said = self.map_records(compressed)
            self.assertIn(f'takes {topic} (sensor_msgs/CompressedImage', said)
            self.assertEqual((self.folder / 'input.cuboids').read_bytes(), expected)
            self.expect_of_node(compressed, type='depth_image')
            said = self.map_records(records + compressed[2:])
            self.assertIn('takes /camera/depth (sensor_msgs/Image', said)
            self.assertIn(f'leaves {topic}', said)
            self.assertEqual((self.folder / 'input.cuboids').read_bytes(), expected)

    def test_compressed_depths_in_metres_are_dequantized(self):
        image = make_depth(np.array([[3.43, 0.52], [np.nan, 40.0]], np.float32))
        camera = ('/camera/camera_info', make_camera(2, 2, 20.0), 1.0)
        self.map_records([STATIC, camera, ('/camera/depth/compressedDepth', compress_depth(image), 1.0)])
        self.assertEqual(sorted(z for _, _, z in self.voxels()), [0.55, 3.45])

    def test_depths_that_cannot_be_decompressed_are_named(self):
        good = depth_of(WALL)
        whole = compress_depth(good[2][1])
        for format_, data, words in (('16UC1; compressedDepth rvl', whole.data, 'Set the format of its image_transport to png'),
                                     (whole.format, whole.data[:40], 'its PNG is damaged'),
                                     (whole.format, whole.data[:5], 'it has no data'),
                                     ('32FC1; png compressed', whole.data[12:], 'Use compressedDepth')):
            bad = compress_depth(good[2][1])
            bad.format, bad.data = format_, data
            records = good[:2] + [('/camera/depth/compressedDepth', message, 1.0) for message in (whole, bad)]
            self.assertIn(words, self.map_records(records))
            self.assertEqual(len(self.voxels()), WALL.size)

    def test_a_recorded_map_is_left_with_a_warning(self):
        recorded = ('/laser_cloud_surround', make_cloud([(0.05, 9.05, 0.05)], frame='map'), 1.0)
        said = self.map_records([STATIC, recorded] + clouds(make_cloud(ROW)))
        self.assertIn('warning: leaves /laser_cloud_surround', said)
        self.assertEqual(self.voxels(), set(ROW))
        said = self.map_records([recorded])
        self.assertIn('warning: /laser_cloud_surround: the clouds are in the frame \'map\'', said)

    def test_the_root_of_the_transforms_is_taken_or_named(self):
        records = [('/tf_static', make_tf('odom', 'lidar'), 0.0)] + clouds(make_cloud(ROW))
        said = self.map_records(records)
        self.assertIn('--set frame_id=odom', said)
        self.assertEqual(self.voxels(), set(ROW))
        said = self.map_records(records, '--set', 'frame_id=map', status=1)
        self.assertIn('roots of tf\'s trees are: odom', said)
        self.map_records(records, '--set', 'frame_id=map', '--transform', 'map odom 0 0 1 0 0 0')
        self.assertEqual(self.voxels(), {(x, y, 1.05) for x, y, _ in ROW})
        said = self.map_records(clouds(make_cloud(ROW)), status=1)
        self.assertIn('map lidar x y z yaw pitch roll', said)
        self.map_records(clouds(make_cloud(ROW)), '--transform', 'map lidar 0 0 1 0 0 0 1')
        self.assertEqual(self.voxels(), {(x, y, 1.05) for x, y, _ in ROW})
        self.assertIn('must be', self.map_records(records, '--transform', 'map odom 0 0 1', status=1))

    def test_scans_of_kitti_are_read(self):
        (self.folder / 'drive/velodyne').mkdir(parents=True)
        for number in range(2):
            np.array([[*ROW[0], 0.5], [*ROW[1], 0.5]], np.float32).tofile(
                self.folder / f'drive/velodyne/{number:06}.bin')
        (self.folder / 'drive/poses.txt').write_text('\ufeff1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 1 0 1 0 0 0 0 1 0\n',
                                                  encoding='utf-8')
        self.map_bags('drive', '--set', f'resolution={RESOLUTION_M}')
        self.assertEqual(self.voxels('drive'), set(ROW[:2]) | {(6.05, y, z) for _, y, z in ROW[:2]})

    def test_scans_have_the_order_of_their_numbers(self):
        (self.folder / 'drive').mkdir()
        for number, point in ((9, ROW[0]), (10, ROW[1])):
            np.array([[*point, 0.5]], np.float32).tofile(self.folder / f'drive/{number}.bin')
        poses = self.folder / 'drive/poses.txt'
        poses.write_text('  # of the lidar\n1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 1 0 1 0 0 0 0 1 0\n')
        self.map_bags('drive', '--set', f'resolution={RESOLUTION_M}')
        self.assertEqual(self.voxels('drive'), {ROW[0], (6.05, *ROW[1][1:])})
        poses.write_text('1 0 0 0 0 1 0 0 0 0 1 0\n-1 0 0 1 0 1 0 0 0 0 1 0\n')
        self.assertIn('poses.txt:2: expected', self.map_bags('drive', status=1))


if __name__ == '__main__':
    os.environ['PYTHONUNBUFFERED'] = '1'
    rospy.init_node('other_inputs')
    rostest.rosrun('cuboid_mapping', 'other_inputs', OtherInputsTest)
