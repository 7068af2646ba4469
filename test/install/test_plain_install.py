#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The libraries built, installed and used without ROS and catkin: the programs of examples/ as outside projects.

usage: test_plain_install.py CMAKE SOURCE_DIR
"""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

CMAKE, SOURCE = sys.argv[1], pathlib.Path(sys.argv[2])
VERSION = re.search('<version>(.*)</version>', (SOURCE / 'package.xml').read_text()).group(1)
# Environment without a sourced workspace.
ENVIRONMENT = {name: value for name, value in os.environ.items()
               if not name.startswith('ROS') and name not in ('CMAKE_PREFIX_PATH', 'LD_LIBRARY_PATH', 'PYTHONPATH')}
# Without optimization, and a library in one unit.
QUICKLY = '-DCMAKE_CXX_FLAGS_RELEASE=-O0', '-DCUBOID_MAPPING_UNITY=WHOLE'


def run(*command):
    return subprocess.run([str(part) for part in command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                          universal_newlines=True, env=ENVIRONMENT)


class PlainInstallTest(unittest.TestCase):

    @classmethod
    def setUpClass(cls):
        cls.root = pathlib.Path(tempfile.mkdtemp(prefix='cuboid_test_'))
        cls.addClassCleanup(shutil.rmtree, cls.root)
        cls.prefix = cls.root / 'prefix'
        # Without parts that compile slowly, to save time.
        cls.succeed(CMAKE, '-S', SOURCE, '-B', cls.root / 'build', '-DCUBOID_MAPPING_ROS=OFF', '-DCUBOID_MAPPING_PYTHON=OFF',
                    *QUICKLY, f'-DCMAKE_INSTALL_PREFIX={cls.prefix}',
                    *[f'-DCMAKE_DISABLE_FIND_PACKAGE_{name}=ON' for name in ('Boost', 'PCL', 'catkin', 'fcl')])
        cls.succeed(CMAKE, '--build', cls.root / 'build', '--', f'-j{os.cpu_count()}')
        cls.succeed(CMAKE, '--install', cls.root / 'build')

    @classmethod
    def succeed(cls, *command):
        done = run(*command)
        if done.returncode != 0:
            raise AssertionError(f'{command} ended with {done.returncode}:\n{done.stdout}')
        return done.stdout

    def configure(self, project, *options):
        return run(CMAKE, '-S', project, '-B', self.root / project.name, f'-DCMAKE_PREFIX_PATH={self.prefix}',
                   '-DCMAKE_CXX_FLAGS=-Wall -Wextra -Wpedantic -Werror', *options)

    def build_example(self, name, *options):
        done = self.configure(SOURCE / 'examples' / name, *options)
        self.assertEqual(done.returncode, 0, done.stdout)
        self.succeed(CMAKE, '--build', self.root / name)
        return self.root / name / name

    def write_project(self, find_package):
        folder = self.root / 'asks'
        folder.mkdir(exist_ok=True)
        (folder / 'CMakeLists.txt').write_text(
            f'cmake_minimum_required(VERSION 3.16)\nproject(asks CXX)\n{find_package}\n')
        shutil.rmtree(self.root / 'asks_build', ignore_errors=True)
        return run(CMAKE, '-S', folder, '-B', self.root / 'asks_build', f'-DCMAKE_PREFIX_PATH={self.prefix}')

    def test_points_in_boxes_out_with_eigen_and_threads_alone(self):
        # A machine without OctoMap and zstd.
        program = self.build_example('first_map', *[f'-DCMAKE_DISABLE_FIND_PACKAGE_{name}=ON'
                                                    for name in ('octomap', 'PkgConfig', 'ZLIB')])
        self.assertEqual(self.succeed(program), '4 m: free\n5 m: occupied\n6 m: unknown\n')
        needed = self.succeed('ldd', program)
        self.assertIn(f'{self.prefix}/lib', needed)
        for foreign in ('pcl', 'octo', 'ros', 'boost', 'zstd', 'libz.', 'not found'):
            self.assertNotIn(foreign, needed.replace(str(self.root), ''))

    def test_questions_of_a_planner(self):
        answers = self.succeed(self.build_example('planner_questions')).splitlines()
        self.assertEqual(answers, ['straight on: blocked after 1.25 m', 'ahead: an obstacle in 1.5 m',
                                   'nearest place to the wall: 1.75  0.5  0.5',
                                   answers[-1]])
        self.assertRegex(answers[-1], r'^around it: 3 free boxes, [34]\.\d+ m$')

    def test_a_path_of_ompl(self):
        if run('pkg-config', '--exists', 'ompl').returncode != 0:
            self.skipTest('a machine without OMPL')
        answer = self.succeed(self.build_example('planners'))
        self.assertRegex(answer, r'around the wall: [3-9]\.\d+ m\n$')

    def test_a_map_from_a_bt_file(self):
        program = self.build_example('from_bt')
        octree = SOURCE / 'test/data/wall.bt'
        answer = self.succeed(program, octree, self.root / 'map.cuboids')
        self.assertRegex(answer, r'^OctoMap \.bt, [\d.]+ m\n\d+ occupied voxels in \d+ cuboids\n$')
        again = self.succeed(program, self.root / 'map.cuboids')
        self.assertEqual(again.split('\n')[1], answer.split('\n')[1])
        self.assertIn('nothing.bt', run(program, self.root / 'nothing.bt').stdout)

    def test_pkg_config(self):
        environment = {**ENVIRONMENT, 'PKG_CONFIG_PATH': f'{self.prefix}/lib/pkgconfig'}
        flags = subprocess.check_output(['pkg-config', '--cflags', '--libs', f'cuboid_mapping >= {VERSION}'], env=environment,
                                        universal_newlines=True).split()
        program = self.root / 'first_map_pc'
        self.succeed('g++', '-std=c++17', SOURCE / 'examples/first_map/first_map.cpp', '-o', program, *flags,
                     f'-Wl,-rpath,{self.prefix}/lib')
        self.assertIn('5 m: occupied', self.succeed(program))

    def test_a_project_has_the_sources_within(self):
        """FetchContent and add_subdirectory: the project's own build type and kind of libraries stay."""
        folder = self.root / 'fetches'
        folder.mkdir()
        (folder / 'CMakeLists.txt').write_text(f'''cmake_minimum_required(VERSION 3.16)
project(fetches LANGUAGES C CXX)
include(FetchContent)
FetchContent_Declare(cuboid_mapping SOURCE_DIR {SOURCE})
FetchContent_MakeAvailable(cuboid_mapping)
add_executable(first_map {SOURCE}/examples/first_map/first_map.cpp)
target_link_libraries(first_map cuboid_mapping::core)
message(STATUS "type '${{CMAKE_BUILD_TYPE}}' shared '${{BUILD_SHARED_LIBS}}'")
''')
        absent = [f'-DCMAKE_DISABLE_FIND_PACKAGE_{name}=ON' for name in ('Boost', 'PCL', 'fcl', 'octomap')]
        said = self.succeed(CMAKE, '-S', folder, '-B', self.root / 'fetched', '-DCUBOID_MAPPING_UNITY=WHOLE', *absent)
        self.assertIn("type '' shared ''", said)
        self.succeed(CMAKE, '--build', self.root / 'fetched', '--target', 'first_map')
        self.assertIn('5 m: occupied', self.succeed(self.root / 'fetched/first_map'))
        self.assertEqual(list((self.root / 'fetched').rglob('*.so*')), [])

    def test_a_catkin_package_beside_ros(self):
        if not shutil.which('catkin_make'):
            self.skipTest('a machine without catkin')
        source = self.root / 'workspace/src/uses_core'
        source.mkdir(parents=True)
        shutil.copy(SOURCE / 'examples/first_map/first_map.cpp', source)
        (source / 'package.xml').write_text(
            '<package format="2"><name>uses_core</name><version>0.1.0</version><description>.</description>'
            '<maintainer email="a@b.cd">a</maintainer><license>BSD</license><buildtool_depend>catkin</buildtool_depend>'
            '<depend>roscpp</depend></package>')
        (source / 'CMakeLists.txt').write_text(
            'cmake_minimum_required(VERSION 3.16)\nproject(uses_core CXX)\nfind_package(catkin REQUIRED COMPONENTS roscpp)\n'
            'find_package(cuboid_mapping ' + VERSION + ' REQUIRED COMPONENTS core)\ncatkin_package()\nadd_executable(first_map first_map.cpp)\n'
            'target_link_libraries(first_map cuboid_mapping::core ${catkin_LIBRARIES})\n')
        # The sourced workspaces without those that have this package, too.
        paths = [path for path in os.environ.get('CMAKE_PREFIX_PATH', '').split(':')
                 if path and not (pathlib.Path(path) / 'share/cuboid_mapping').is_dir()]
        self.succeed('catkin_make', '-C', source.parents[1], f"-DCMAKE_PREFIX_PATH={';'.join([str(self.prefix), *paths])}",
                     f'-DPYTHON_EXECUTABLE={sys.executable}')
        program = source.parents[1] / 'devel/lib/uses_core/first_map'
        self.assertIn('5 m: occupied', self.succeed(program))
        self.assertIn(f'{self.prefix}/lib/libcuboid_mapping_core', self.succeed('ldd', program))

    def test_what_is_not_there_is_said(self):
        newer = self.write_project('find_package(cuboid_mapping 9.0 REQUIRED)')
        self.assertNotEqual(newer.returncode, 0)
        self.assertIn(VERSION, newer.stdout)
        missing = self.write_project('find_package(cuboid_mapping REQUIRED COMPONENTS core fcl)')
        self.assertNotEqual(missing.returncode, 0)
        self.assertIn('cuboid_mapping::fcl has not been built; there are: core;no_return;io;octomap.',
                      ' '.join(missing.stdout.split()))  # CMake breaks lines.
        optional = self.write_project('find_package(cuboid_mapping REQUIRED COMPONENTS core OPTIONAL_COMPONENTS fcl)')
        self.assertEqual(optional.returncode, 0, optional.stdout)

    def test_octomap_where_it_is_asked_for(self):
        done = self.write_project('find_package(cuboid_mapping REQUIRED COMPONENTS octomap)\n'
                                  'file(WRITE ${CMAKE_CURRENT_SOURCE_DIR}/use.cpp "#include <cuboid_mapping/interop/octomap_parity.h>\\n")\n'
                                  'add_library(use use.cpp)\ntarget_link_libraries(use cuboid_mapping::octomap)')
        self.assertEqual(done.returncode, 0, done.stdout)
        self.succeed(CMAKE, '--build', self.root / 'asks_build')


if __name__ == '__main__':
    del sys.argv[1:3]
    unittest.main()
