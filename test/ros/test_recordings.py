#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Recordings that nobody can edit: single wrong messages, two runs in one, gaps, other names, places. bag_to_map and the
node map what is right, or say what to do."""
import math
import os
import resource
import subprocess

import numpy as np
import rospy
import rostest
from input_cases import RESOLUTION_M, ROW, STATIC, WALL, InputCase, clouds, depth_of
from nav_msgs.msg import Odometry
from sensor_bags import at, make_camera, make_cloud, make_depth, make_tf, write_bag
from waiting import program, wait_for

BACK = [(-x, y, z) for x, y, z in ROW]
URDF = """<robot name="r"><link name="arm"><collision><geometry><box size="0.4 2 2"/></geometry></collision></link></robot>"""


def drive(first_s, last_s, y=0.0, speed=1.0, name='base', step_s=0.1):
    """Transforms of a robot that drives along x."""
    return [('/tf', make_tf('map', name, time_s, (speed * time_s, y, 0.0)), time_s)
            for time_s in np.arange(first_s, last_s, step_s)]


def odometry(time_s, x, y=0.0, w=1.0):
    message = Odometry(child_frame_id='base')
    message.header.stamp, message.header.frame_id = at(time_s), 'map'
    message.pose.pose.position.x, message.pose.pose.position.y = x, y
    message.pose.pose.orientation.w = w
    return message


class RecordingsTest(InputCase):

    # One wrong message.

    def test_one_leading_stamp_forgets_nothing(self):
        for leading_s in (0.0, 48.0, 3600.0):
            messages = [make_cloud(ROW if number < 6 else BACK, 1.0 + 0.1 * number + (leading_s if number == 9 else 0.0))
                        for number in range(12)]
            records = [STATIC] + clouds(*messages)
            self.map_records(records, '--set', 'forget_after=20')
            self.assertEqual(self.voxels(), set(BACK) | set(ROW))
        self.expect_of_node(records, forget_after=20.0)

    def test_sources_may_have_clocks_of_their_own(self):
        records = [STATIC]
        for number in range(12):
            for name, points, late_s in (('/a', ROW, 0.0), ('/b', BACK, 1200.0)):
                records.append((name, make_cloud(points, 5000.0 + 0.1 * number - late_s), 0.1 * number))
        self.map_records(records, '--set', 'forget_after=20', 'sources=[{name: a, topic: /a}, {name: b, topic: /b}]')
        self.assertEqual(self.voxels(), set(BACK) | set(ROW))

    def test_a_camera_info_without_calibration_does_not_count(self):
        for broken in (0.0, math.nan):
            uncalibrated = make_camera(2, 2, broken, 0.9)
            uncalibrated.P = uncalibrated.K = [broken] * len(uncalibrated.K)
            uncalibrated.P = [broken] * 12
            good = depth_of(WALL)
            records = [STATIC, ('/camera/camera_info', uncalibrated, 0.9), good[1],
                       ('/camera/depth', make_depth(WALL, 0.9), 1.0)]
            said = self.map_records(records)
            self.assertNotIn('focal length', said)
            self.assertEqual(len(self.voxels()), WALL.size)
            self.expect_of_node(records, type='depth_image')
        self.assertIn('no focal length', self.map_records(records[:2] + records[3:], status=1))

    def test_wrong_transforms_cost_themselves_alone(self):
        self.map_records(drive(0.0, 2.0) + clouds(make_cloud(ROW, frame='base')))
        expected = self.voxels()
        for wrong in (make_tf('map', 'base', 0.95, (math.nan, 0.0, 0.0)), make_tf('map', 'base', 0.95, rotation=(0.0,) * 4),
                      make_tf('map', 'base', 1.0, (0.9, 0.0, 0.0)), make_tf('map', 'base', -at(0.0).to_sec())):
            records = drive(0.0, 1.05) + [('/tf', wrong, 1.06)] + drive(1.1, 2.0) + clouds(make_cloud(ROW, frame='base'))
            self.map_records(records)
            self.assertEqual(self.voxels(), expected)

    # Two runs.

    def test_two_runs_are_refused_and_two_recordings_of_one_are_not(self):
        cloud = clouds(make_cloud(ROW, frame='base'))
        settings = ['--set', f'resolution={RESOLUTION_M}']
        write_bag(self.folder / 'a.bag', drive(0.0, 5.0) + cloud)
        write_bag(self.folder / 'again.bag', drive(0.0, 5.0))
        self.map_bags('a.bag', 'again.bag', *settings)
        runs = {'same times': drive(0.0, 5.0, 3.0, -1.0), 'others': drive(0.03, 5.0, 3.0),
                'slower': drive(0.03, 5.0, 3.0, step_s=0.31)}
        for name, run in runs.items():
            write_bag(self.folder / 'b.bag', run + cloud)
            said = self.map_bags('a.bag', 'b.bag', *settings, status=1)
            self.assertIn("'base' jumps to and fro between two places: a.bag, b.bag has", said, name)
            self.assertIn('map_merge', said)
            self.map_bags('b.bag', *settings)
            write_bag(self.folder / 'both.bag', drive(0.0, 5.0) + run + cloud)  # Recorded across a reset.
            self.assertIn('rosbag filter', self.map_bags('both.bag', *settings, status=1))
        # A frame that no sensor is on, and a pose that is corrected now and then.
        other = [('/tf', make_tf('map', 'person', 0.1 * number, (3.0 * (number % 2), 0.0, 0.0)), 0.1 * number)
                 for number in range(40)]
        write_bag(self.folder / 'b.bag', other + drive(5.0, 6.0, 2.0) + drive(6.0, 7.0, -2.0))
        self.map_bags('a.bag', 'b.bag', *settings)

    def test_poses_of_two_runs_are_refused(self):
        records = [('/odom', odometry(0.1 * number + 0.05 * run, 0.1 * number, 4.0 * run), 0.1 * number + 0.05 * run)
                   for number in range(40) for run in (0, 1)] + clouds(make_cloud(ROW, frame='base'))
        self.assertIn('map_merge', self.map_records(records, '--poses', '/odom', status=1))
        self.map_records([record for record in records if record[0] != '/odom' or record[1].pose.pose.position.y == 0.0],
                         '--poses', '/odom')

    def test_the_node_names_two_publishers_of_a_frame(self):
        with open(self.folder / 'log.txt', 'w', encoding='utf-8') as log, \
                subprocess.Popen([program('cuboid_mapping_node'), '__name:=torn', 'cloud_in:=/torn'], stderr=log) as node:
            try:
                rospy.wait_for_service('/torn/save_map', 60.0)
                publisher = rospy.Publisher('/tf', type(drive(0.0, 0.1)[0][1]), queue_size=100)
                self.assertTrue(wait_for(lambda: publisher.get_num_connections() > 0))
                for (_, one, _), (_, other, _) in zip(drive(0.0, 4.0), drive(0.0, 4.0, 3.0)):
                    publisher.publish(one)
                    publisher.publish(other)
                    rospy.sleep(0.01)
                read = (self.folder / 'log.txt').read_text
                self.assertTrue(wait_for(lambda: "'base' jumps to and fro" in read(encoding='utf-8'), 10.0))
                self.assertEqual(read(encoding='utf-8').count('jumps to and fro'), 1)
                publisher.unregister()
            finally:
                node.terminate()

    # Gaps, and other names.

    def test_poses_of_a_file_are_not_interpolated_across_a_gap(self):
        (self.folder / 'poses.txt').write_text(''.join(
            f'{at(time_s).to_sec():.3f} {time_s} 0 0 0 0 0 1\n' for time_s in (0.0, 0.5, 1.0, 9.0, 9.5)))
        records = clouds(make_cloud(ROW, 0.75, 'base'), make_cloud(BACK, 5.0, 'base'), make_cloud(ROW, 9.25, 'base'))
        said = self.map_records(records, '--poses', 'poses.txt')
        self.assertIn('1 cloud dropped, in a gap of tf: --poses has no pose for 8 s', said)
        self.assertIn('raise tf_gap', said)
        self.assertIn('2 of 3 clouds', self.map_summary(records, '--poses', 'poses.txt'))
        self.assertIn('3 of 3 clouds', self.map_summary(records, '--poses', 'poses.txt', '--set', 'tf_gap=10'))

    def map_summary(self, records, *options):
        write_bag(self.folder / 'input.bag', records)
        return subprocess.run([program('bag_to_map'), 'input.bag', *options], cwd=self.folder, check=True,
                              capture_output=True, text=True).stdout

    def test_links_of_a_robot_are_found_with_the_prefix_of_its_frames(self):
        (self.folder / 'robot.urdf').write_text(URDF)
        on_robot = ROW + [(1.0, 0.0, 0.0)]
        options = {'self_filter/robot_description': self.folder / 'robot.urdf'}
        for names in (['arm'], ['r1/arm'], ['r1/arm', 'r2/arm']):
            records = [('/tf_static', make_tf('map', 'r1/lidar'), 0.0)]
            records += [('/tf_static', make_tf('map', name, position=(1.0 if name != 'r2/arm' else 9.0, 0.0, 0.0)), 0.0)
                        for name in names]
            records += clouds(make_cloud(on_robot, frame='r1/lidar'))
            self.map_records(records, '--set', f'self_filter/robot_description={self.folder}/robot.urdf')
            self.assertEqual(self.voxels(), set(ROW), names)
        self.expect_of_node(records, **options)

    # Data sets.

    def write_drive(self, data, calibration=None, name='000000.bin'):
        folder = self.folder / 'drive'
        (folder / 'velodyne').mkdir(parents=True, exist_ok=True)
        data.tofile(folder / 'velodyne' / name)
        (folder / 'poses.txt').write_text('1 0 0 0 0 1 0 0 0 0 1 0\n')
        (folder / 'calib.txt').unlink(missing_ok=True)
        if calibration is not None:
            (folder / 'calib.txt').write_text(calibration)

    def test_rows_of_bin_files_are_those_that_make_sense(self):
        y, z = (axis.ravel() for axis in np.meshgrid(np.arange(-0.95, 1.0, 0.1), np.arange(-0.95, 1.0, 0.1)))
        wall = np.c_[np.full(y.size, 10.05), y, z]
        expected = {tuple(np.round(point, 2) + 0.0) for point in wall}
        strength, ring, zero = np.linspace(5, 90, y.size), np.arange(y.size) % 32, np.zeros(y.size)
        settings = ['--set', f'resolution={RESOLUTION_M}']
        for columns, kind in (([wall], '<f4'), ([wall, strength / 100], '<f4'), ([wall, strength, ring], '<f4'),
                              ([wall, strength, ring, 1e-3 * ring], '<f4'), ([wall, zero], '<f4'), ([wall], '<f8'),
                              ([wall, strength], '<f8')):
            for count in (400, 399):
                self.write_drive(np.column_stack(columns).astype(kind)[:count])
                self.map_bags('drive', *settings)
                self.assertEqual(len(self.voxels('drive') - expected), 0)
                self.assertEqual(len(self.voxels('drive')), count)
        self.write_drive(np.r_[np.c_[wall, zero], np.full((400, 4), np.nan)].astype('<f4'))
        self.map_bags('drive', *settings)
        self.assertEqual(self.voxels('drive'), expected)
        rows = np.zeros(400, [('x', '<f4'), ('y', '<f4'), ('z', '<f4'), ('t', '<u4'), ('r', '<u2'), ('n', 'u1')])
        rows['x'], rows['y'], rows['z'] = wall.T
        rows['t'] = np.arange(400) * 1000
        self.write_drive(rows)
        self.assertIn('--bin-row', self.map_bags('drive', *settings, status=1))
        self.map_bags('drive', *settings, '--bin-row', rows.itemsize)
        self.assertEqual(self.voxels('drive'), expected)
        for wrong in ('4', '12x', 'd', '20d', '2000'):
            self.assertIn('must be the bytes of a row', self.map_bags('drive', '--bin-row', wrong, status=1))

    def test_a_calibration_has_a_transform_of_the_lidar_or_is_refused(self):
        points = np.array([[5.05, 0.05, 0.05, 1.0]] * 4, np.float32)
        cameras = ''.join(f'P{number}: 718.8 0 607 0 0 718.8 185 0 0 0 1 0\n' for number in range(4))
        lidar = '0 -1 0 0 0 0 -1 0 1 0 0 0\n'
        for calibration in (None, 'Tr: ' + lidar, cameras + 'Tr: ' + lidar, cameras + 'Tr_velo_to_cam: ' + lidar,
                            cameras + 'R_rect 1 0 0 0 1 0 0 0 1\nTr_velo_cam ' + lidar + 'Tr_imu_velo ' + lidar):
            self.write_drive(points, calibration)
            self.map_bags('drive', '--set', f'resolution={RESOLUTION_M}')
            self.assertEqual(self.voxels('drive'), {(5.05, 0.05, 0.05)})
        for calibration, words in ((cameras, 'has no transform from lidar to camera'), ('Tr: 1 2 3', "'Tr' and 12 numbers")):
            self.write_drive(points, calibration)
            self.assertIn(words, self.map_bags('drive', status=1))

    def test_poses_of_a_camera_need_its_calibration(self):
        start, ahead, lost = '1 0 0 0 0 1 0 0 0 0 1 0', '1 0 0 0 0 1 0 0 0 0 1 5', ' '.join(['0'] * 12)
        for pose, words in ((ahead, "along their z axis, as a camera's do"), (lost, 'poses.txt:2: expected')):
            for number in range(2):
                self.write_drive(np.array([[5.05, 0.05, 0.05, 1.0]] * 4, np.float32), name=f'{number:06}.bin')
            (self.folder / 'drive/poses.txt').write_text(f'{start}\n{pose}\n')
            self.assertIn(words, self.map_bags('drive', status=1))
        (self.folder / 'drive/poses.txt').write_text(f'{start}\n{ahead}\n')
        (self.folder / 'drive/calib.txt').write_text(f'Tr: {start}\n')
        self.map_bags('drive', '--set', f'resolution={RESOLUTION_M}')
        self.assertEqual(self.voxels('drive'), {(5.05, 0.05, 0.05), (5.05, 0.05, 5.05)})

    # Places.

    def test_more_bags_than_open_files_are_named(self):
        write_bag(self.folder / 'a.bag', [STATIC] + clouds(make_cloud(ROW)))
        limits = resource.getrlimit(resource.RLIMIT_NOFILE)

        def run(soft, hard):
            return subprocess.run([program('bag_to_map'), *['a.bag'] * 100], cwd=self.folder, capture_output=True,
                                  text=True, preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard)))
        self.assertEqual(run(50, limits[1]).returncode, 0, 'it raises its own limit')
        end = run(50, 50)
        self.assertEqual(end.returncode, 1)
        self.assertIn('100 bags are more than the 50 files that may be open: raise the limit (ulimit -n 164)', end.stderr)

    def test_a_map_may_have_a_name_of_any_length(self):
        name = 'm' * 247 + '.cuboids'
        write_bag(self.folder / 'a.bag', [STATIC] + clouds(make_cloud(ROW)))
        self.map_bags('a.bag', '-o', name)
        self.assertEqual([file.name for file in self.folder.glob('m*')], [name])
        self.assertIn('File name too long', self.map_bags('a.bag', '-o', 'm' + name, status=1))

    def test_a_file_that_is_a_mount_is_refused_at_the_start(self):
        write_bag(self.folder / 'a.bag', [STATIC] + clouds(make_cloud(ROW)))
        (self.folder / 'a map.cuboids').write_text('')
        mount = 'mount --bind "a map.cuboids" "a map.cuboids" || exit 77; '
        end = subprocess.run(['unshare', '-rm', 'sh', '-c', mount + f'{program("bag_to_map")} a.bag -o "a map.cuboids"'],
                             cwd=self.folder, capture_output=True, text=True)
        if end.returncode == 77 or 'unshare' in end.stderr:
            self.skipTest('no mounts here: ' + end.stderr)
        self.assertEqual(end.returncode, 1)
        self.assertIn('it is mounted as a single file, which cannot be replaced: mount its folder', end.stderr)


if __name__ == '__main__':
    os.environ['PYTHONUNBUFFERED'] = '1'
    rospy.init_node('recordings')
    rostest.rosrun('cuboid_mapping', 'recordings', RecordingsTest)
