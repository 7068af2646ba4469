#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""debian/ agrees with the lists of packages, the version and the SONAME. campaign/deb tries the packages.

usage: test_debian.py SOURCE_DIR
"""
import pathlib
import re
import sys
import unittest

SOURCE = pathlib.Path(sys.argv[1])
VERSION = re.search('<version>(.*)</version>', (SOURCE / 'package.xml').read_text()).group(1)


def listed(*names):
    lines = '\n'.join((SOURCE / f'scripts/packages/{name}.txt').read_text() for name in names).split('\n')
    return {line for line in lines if line and not line.startswith('#')}


def read_control():
    """Fields of each package by its name; the source's by ''."""
    packages = {}
    for text in (SOURCE / 'debian/control').read_text().strip().split('\n\n'):
        fields = dict(re.findall(r'^([\w-]+):((?:.*)(?:\n .*)*)', text, re.MULTILINE))
        packages[fields.get('Package', '').strip()] = fields
    return packages


def names(field):
    return {re.split(r'[\s(]', entry.strip())[0] for entry in field.split(',') if entry.strip() and '$' not in entry.strip()[0]}


class DebianTest(unittest.TestCase):

    @classmethod
    def setUpClass(cls):
        cls.packages = read_control()
        cls.node = cls.packages['ros-cuboid-mapping']

    def test_what_the_build_needs_is_what_scripts_build_installs(self):
        needed = names(self.packages['']['Build-Depends'])
        self.assertEqual(listed('library', 'build', 'python') - {'g++', 'make'},
                         needed - {'debhelper-compat', 'dh-ros', 'dh-sequence-python3', 'libfcl-dev'})

    def test_what_the_node_needs_to_run_is_what_the_list_has(self):
        needed = names(self.node['Depends']) | names(self.node['Recommends'])
        own = {'python3', 'python3-rospy', 'python3-cuboid-map', 'ros-cuboid-mapping-demo'}
        self.assertEqual(listed('run'), needed - own)
        self.assertFalse(names(self.node['Depends']) & names(self.node['Recommends']))

    def test_a_node_without_a_window_is_small(self):
        for name in ('rviz', 'python3-nav-msgs', 'python3-rosbag', 'python3-rosmsg', 'ros-message-runtime'):  # Some bring compilers.
            self.assertNotIn(name, names(self.node['Depends']))

    def test_the_version_is_that_of_package_xml(self):
        first = (SOURCE / 'debian/changelog').read_text().partition('\n')[0]
        self.assertIn(f'({VERSION})', first)
        self.assertEqual(set(re.findall(r'^ *version: (.*)', (SOURCE / 'CITATION.cff').read_text(), re.MULTILINE)), {VERSION})
        soname = '.'.join(VERSION.split('.')[:2])
        libraries = [name for name in self.packages if re.match(r'libcuboid-mapping.*\d$', name)]
        self.assertEqual(len(libraries), 3)
        for name in libraries:
            self.assertTrue(name.endswith(soname), name)
        files = {file.stem for file in (SOURCE / 'debian').glob('*.install')}
        self.assertEqual(files, set(self.packages) - {''})

    def test_plugins_are_found_by_their_name(self):
        """pluginlib looks in lib, and the system's loader in lib/ARCHITECTURE."""
        for name in ('nodelet_plugins.xml', 'rviz_plugins.xml'):
            self.assertRegex((SOURCE / name).read_text(), r'<library path="libcuboid_mapping_\w+">')


if __name__ == '__main__':
    del sys.argv[1:]
    unittest.main()
