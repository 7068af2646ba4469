#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Compares package.xml with the dependencies of the sources, and with the keys of rosdep.

usage: test_package_xml.py SOURCE_DIR
"""
import pathlib
import re
import sys
import unittest
import xml.etree.ElementTree as ET

import rospkg

SOURCE = pathlib.Path(sys.argv[1])
# Keys of rosdep's base.yaml and python.yaml, which Debian does not ship, with Debian's packages.
SYSTEM_KEYS = {
    'doxygen': 'doxygen',
    'eigen': 'libeigen3-dev',
    'google-mock': 'libgmock-dev',
    'gtest': 'libgtest-dev',
    'imagemagick': 'imagemagick',
    'libboost-program-options-dev': 'libboost-program-options-dev',
    'libpcl-all-dev': 'libpcl-dev',
    'libpng-dev': 'libpng-dev',
    'libsqlite3-dev': 'libsqlite3-dev',
    'libzstd-dev': 'libzstd-dev',
    'nlohmann-json-dev': 'nlohmann-json3-dev',
    'pkg-config': 'pkg-config',
    'pybind11-dev': 'pybind11-dev',
    'python3-numpy': 'python3-numpy',
    'python3-pil': 'python3-pil',
    'python3-pytest': 'python3-pytest',
    'python3-scipy': 'python3-scipy',
    'xvfb': 'xvfb',
    'yaml-cpp': 'libyaml-cpp-dev',
    'zlib': 'zlib1g-dev',
}
# The display and its tests are left out without these; rviz depends on interactive_markers.
OF_A_SCREEN = {'rviz', 'interactive_markers'}
# Used by header-only parts: users who include them have it.
OF_A_USER = {'ompl'}
# Only ROS Noetic's package index has it, Debian's does not.
NOETIC_ONLY = {'octomap_msgs'}


def read_all(*patterns):
    return '\n'.join(path.read_text() for pattern in patterns for path in sorted(SOURCE.glob(pattern)))


def read_debian_index():
    """Debian's packages of each key of rosdep."""
    index = pathlib.Path('/usr/share/python3-rosdep2/debian.yaml')
    if not index.exists():
        raise unittest.SkipTest('only Debian has this index')
    return {key: set(re.findall('- (.+)', packages))
            for key, packages in re.findall(r'^([\w-]+):\n((?: .*\n)*)', index.read_text(), re.MULTILINE)}


class PackageXml(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        root = ET.parse(SOURCE / 'package.xml').getroot()
        cls.keys = {}
        for element in root:
            if element.tag.endswith('depend'):
                cls.keys.setdefault(element.text, set()).add(element.tag)
        cls.ros_packages = set(rospkg.RosPack().list()) - {'cuboid_mapping'}

    def expect_declared(self, used, tags):
        self.assertGreater(len(used), 3)
        for name in sorted(used):
            self.assertTrue(self.keys.get(name, set()) & tags, f'{name} is used and not declared')

    def test_headers_of_the_package(self):
        code = read_all('include/**/*.h', 'src/**/*.h', 'src/**/*.cpp', 'benchmark/**/*.cpp')
        used = set(re.findall(r'#include <(\w+)/', code)) & self.ros_packages
        self.expect_declared(used - NOETIC_ONLY - OF_A_SCREEN - OF_A_USER, {'depend', 'build_depend'})

    def test_headers_of_the_tests(self):
        used = set(re.findall(r'#include <(\w+)/', read_all('test/**/*.h', 'test/**/*.cpp'))) & self.ros_packages
        self.expect_declared(used - OF_A_SCREEN - OF_A_USER, {'depend', 'test_depend'})

    def test_python(self):
        code = read_all('python/**/*.py', 'test/**/*.py')
        used = set(re.findall(r'^(?:import|from) (\w+)', code, re.MULTILINE)) & self.ros_packages
        self.expect_declared(used, {'depend', 'exec_depend', 'test_depend'})

    def test_nodes_of_launch_files(self):
        code = read_all('launch/*.launch', 'test/**/*.test')
        used = set(re.findall(r'pkg="(\w+)"', code)) - {'cuboid_mapping'}
        for name in used:
            self.assertIn(name, self.keys)
        self.assertLessEqual({'nodelet', 'rosbag', 'rviz'}, used)

    def test_a_robot_needs_no_screen(self):
        for name in ('xvfb', 'imagemagick'):
            self.assertEqual(self.keys[name], {'test_depend'})
        # rviz searches plugins only in packages with a run dependency on it.
        package = (SOURCE / 'package.xml').read_text()
        self.assertIn('<exec_depend condition="$CUBOID_MAPPING_RVIZ != no">rviz</exec_depend>', package)
        self.assertEqual(self.keys['rviz'], {'exec_depend'})

    def test_system_keys_have_debian_packages(self):
        listed = read_all('scripts/packages/*.txt').split('\n')
        for key in sorted(set(self.keys) & set(SYSTEM_KEYS)):
            self.assertIn(SYSTEM_KEYS[key], listed, key)
        self.assertLessEqual(set(SYSTEM_KEYS), set(self.keys), 'the table of this test has keys too many')

    def test_ros_keys_are_known_to_debian(self):
        keys = read_debian_index()
        self.assertGreater(len(keys), 100)
        self.assertLessEqual(set(self.keys) - set(SYSTEM_KEYS) - NOETIC_ONLY, set(keys))

    def test_what_debian_needs_to_run_is_declared(self):
        keys = read_debian_index()
        for package in read_all('scripts/packages/run.txt').split('\n'):
            named = {key for key, packages in keys.items() if package in packages}
            self.assertTrue(not named or named & set(self.keys), package)


if __name__ == '__main__':
    del sys.argv[1:]
    unittest.main()
