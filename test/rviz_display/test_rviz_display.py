#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Pictures of the display in rviz on a virtual screen, compared with golden ones.

With CUBOID_MAPPING_GOLDEN=write, the golden pictures are written; look at them before they are committed.
"""
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest

import numpy
import rospy
import yaml
from cuboid_mapping.msg import Box
from cuboid_mapping.srv import SetBox, SetBoxRequest
from geometry_msgs.msg import Point

GOLDEN = pathlib.Path(__file__).resolve().parent / 'golden'
PACKAGE = GOLDEN.parent.parent.parent
sys.path.insert(0, str(PACKAGE / 'test/ros'))
from waiting import program  # noqa: E402

PATIENCE_S = 120.0
# Late releases of rviz cover the picture with a notice that ROS Noetic has ended.
WITHOUT_A_CARD = {'LIBGL_ALWAYS_SOFTWARE': '1', 'DISABLE_ROS1_EOL_WARNINGS': '1'}
# Mean difference of a pixel. Software renderers differ along edges; with Qt 6 the buttons are lower and the picture is
# some pixels higher, 5.7 at most.
TOLERANCE = 6.5


def run(*command):
    return subprocess.run(command, check=True, capture_output=True, timeout=PATIENCE_S).stdout


def start(*command, **environment):
    return subprocess.Popen(command, env={**os.environ, **environment}, stdout=subprocess.DEVNULL,
                            stderr=subprocess.DEVNULL, start_new_session=True)


def stop(process):
    if process.poll() is not None:
        return
    os.killpg(process.pid, signal.SIGTERM)
    try:
        process.wait(10.0)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()


def read_pixels(picture):
    """Reads a picture in any format of ImageMagick as height x width x 3 numbers."""
    size = run('identify', '-format', '%h %w', picture).decode().split()
    return numpy.frombuffer(run('convert', picture, '-depth', '8', 'rgb:-'), numpy.uint8).astype(
        float).reshape(int(size[0]), int(size[1]), 3)


class TestDisplay(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp())
        cls.map = cls.folder / 'map.cuboids'
        bag = cls.folder / 'drive.bag'
        run(program('simulated_lidar'), '--bag', bag, '--duration', '8')
        run(program('bag_to_map'), bag, '-o', cls.map, '--set', 'resolution=0.2')
        number = 90
        while os.path.exists(f'/tmp/.X{number}-lock'):
            number += 1
        cls.screen = f':{number}'
        cls.server = start('Xvfb', cls.screen, '-screen', '0', '800x600x24', '+extension', 'GLX',
                           '-nolisten', 'tcp')
        cls.last = None

    @classmethod
    def tearDownClass(cls):
        stop(cls.server)
        shutil.rmtree(cls.folder)

    def configure(self, **properties):
        """Writes a configuration of rviz with one display of the map. Returns its path."""
        config = yaml.safe_load((PACKAGE / 'rviz' / 'demo.rviz').read_text())
        config['Panels'] = []
        config['Window Geometry'].update(Width=800, Height=600)
        manager = config['Visualization Manager']
        manager['Views']['Current'].update({'Distance': 24.0, 'Focal Point': {'X': 8.0, 'Y': 4.0, 'Z': 0.0}})
        manager['Displays'] = [{'Class': 'cuboid_mapping/CuboidMap', 'Enabled': True, 'Name': 'Map',
                                'Value': True, **properties}]
        file = self.folder / 'display.rviz'
        file.write_text(yaml.safe_dump(config))
        return file

    def shoot(self, is_wanted, **properties):
        """The first picture for which is_wanted is true, at a quarter of its size."""
        viewer = start('rosrun', 'rviz', 'rviz', '-d', str(self.configure(**properties)),
                       DISPLAY=self.screen, **WITHOUT_A_CARD)
        picture = self.folder / 'picture.png'
        pixels = None
        end = time.monotonic() + PATIENCE_S
        try:
            while time.monotonic() < end:
                time.sleep(1.0)
                self.assertIsNone(viewer.poll(), 'rviz has ended by itself')
                if subprocess.run(['import', '-display', self.screen, '-window', 'root', '-crop',
                                   '720x440+40+100', '+repage', '-resize', '25%', picture],
                                  stderr=subprocess.DEVNULL, check=False).returncode != 0:
                    continue
                pixels = read_pixels(picture)
                if is_wanted(pixels):
                    break
        finally:
            stop(viewer)
        return pixels

    def expect_golden(self, name, **properties):
        golden = GOLDEN / f'{name}.png'
        if os.environ.get('CUBOID_MAPPING_GOLDEN') == 'write':
            time_s = time.monotonic()
            self.shoot(lambda pixels: time.monotonic() > time_s + 20.0, **properties)
            GOLDEN.mkdir(exist_ok=True)
            shutil.copy(self.folder / 'picture.png', golden)
            return
        wanted = read_pixels(golden)

        def difference(pixels):
            return numpy.abs(pixels - wanted).mean() if pixels.shape == wanted.shape else 255.0

        pixels = self.shoot(lambda pixels: difference(pixels) < TOLERANCE, **properties)
        self.assertLess(difference(pixels), TOLERANCE, name)

    def file(self):
        return {'Map file': str(self.map)}

    def test_colors_by_height(self):
        self.expect_golden('height', **self.file())

    def test_follows_a_node(self):
        node = start('rosrun', 'cuboid_mapping', 'cuboid_mapping_node', '__name:=mapping', '__ns:=/robot',
                     f'_map_file:={self.map}', '_resolution:=0.2')
        try:
            self.expect_golden('height', **{'Topic namespace': '/robot', 'Server': 'mapping'})
        finally:
            stop(node)

    def test_colors_by_probability_without_edges(self):
        self.expect_golden('probability', **self.file(), **{'Color by': 'Probability', 'Edges': False})

    def test_colors_by_size_in_a_range_of_heights(self):
        self.expect_golden('size', **self.file(), **{
            'Color by': 'Cuboid size', 'Height range': {'Value': True, 'Min': -0.5, 'Max': 1.0}})

    def test_shows_free_cuboids_and_the_frontier_in_a_box(self):
        box = {'Value': True, 'Min': {'X': 0, 'Y': 0, 'Z': -1}, 'Max': {'X': 15, 'Y': 8, 'Z': 2}}
        self.expect_golden('classes', **self.file(), **{
            'Color by': 'Class', 'Free': {'Value': True, 'Alpha': 0.2}, 'Frontier': True, 'Clip box': box})

    def test_colors_by_a_given_range_of_heights(self):
        self.expect_golden('height_given', **self.file(), **{
            'Occupied': {'Value': True, 'Alpha': 0.5},
            'Color by': {'Value': 'Height', 'Fit to heights': False, 'Lowest': 0.5, 'Highest': 1.5}})

    def test_shows_cross_sections_at_a_height(self):
        self.expect_golden('slice', **self.file(), **{
            'Color by': 'Class', 'Free': {'Value': True, 'Alpha': 0.6}, 'Slice': {'Value': True, 'Height': 0.5}})

    def test_fills_what_is_cut_above_the_map_below(self):
        self.expect_golden('slice_below', **self.file(), **{
            'Color by': 'Cuboid size', 'Slice': {'Value': True, 'Height': 0.5, 'Show below': True}})

    def test_shows_what_has_changed_of_late(self):
        node = start('rosrun', 'cuboid_mapping', 'cuboid_mapping_node', '__name:=changing', '__ns:=/robot',
                     f'_map_file:={self.map}', '_resolution:=0.2')
        is_done = threading.Event()
        editor = threading.Thread(target=self.change_box, args=(is_done,))
        editor.start()
        try:
            self.expect_golden('recent', **{
                'Topic namespace': '/robot', 'Server': 'changing', 'Changed in last': 1000.0})
        finally:
            is_done.set()
            editor.join()
            stop(node)

    def change_box(self, is_done):
        """Changes a box repeatedly, and restores it: rviz may subscribe at any time."""
        set_box = rospy.ServiceProxy('/robot/changing/set_box', SetBox)
        set_box.wait_for_service(PATIENCE_S)
        box = Box(Point(4.0, 3.0, 0.0), Point(7.0, 5.0, 1.2))
        while not is_done.wait(1.0):
            for occupancy in (SetBoxRequest.UNKNOWN, SetBoxRequest.OCCUPIED):
                set_box(SetBoxRequest(occupancy=occupancy, boxes=[box]))

    def test_shows_nothing_where_the_file_is_none(self):
        def is_gray(pixels):
            return (pixels.max(axis=2) - pixels.min(axis=2)).max() < 20.0

        pixels = self.shoot(lambda pixels: is_gray(pixels) and pixels.mean() > 5.0,
                            **{'Map file': str(self.folder / 'missing.cuboids')})
        self.assertTrue(is_gray(pixels))

    def expect_success(self, suites):
        end = subprocess.run([program('test_displays'), '--gtest_filter=' + suites],
                             capture_output=True, text=True, timeout=PATIENCE_S,
                             env={**os.environ, 'DISPLAY': self.screen, **WITHOUT_A_CARD}, check=False)
        self.assertEqual(end.returncode, 0, end.stdout[-4000:] + end.stderr[-2000:])

    def test_does_not_crash_or_block(self):
        self.expect_success('DisplayLife.*')

    def test_draws_distances_and_frontiers(self):
        self.expect_success('DistanceColors.*:FrontierPicture.*:ViewedPart.*:MapLayers.*')

    def expect_success_beside_node(self, suites):
        node = start('rosrun', 'cuboid_mapping', 'cuboid_mapping_node', '__name:=mapping', '__ns:=/panel',
                     f'_map_file:={self.map}', '_resolution:=0.2')
        try:
            rospy.wait_for_service('/panel/mapping/query_box', PATIENCE_S)
            self.expect_success(suites)
        finally:
            stop(node)

    def test_panel_shows_and_calls_a_node(self):
        self.expect_success_beside_node('MapPanelTest.*')

    def test_tool_edits_with_the_mouse(self):
        self.expect_success_beside_node('EditToolTest.*')


if __name__ == '__main__':
    import rostest
    rospy.init_node('test_rviz_display', disable_signals=True)
    rostest.rosrun('cuboid_mapping', 'rviz_display', TestDisplay)
