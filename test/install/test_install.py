#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The install space has all files that programs, launch files and other packages need.

usage: test_install.py CMAKE SOURCE_DIR BUILD_DIR DEVEL_SPACE PREFIX
"""
import os
import pathlib
import re
import shutil
import signal
import socket
import subprocess
import sys
import sysconfig
import tempfile
import time
import unittest

CMAKE, *FOLDERS = sys.argv[1:6]
SOURCE, BUILD, DEVEL, PREFIX = map(pathlib.Path, FOLDERS)
PACKAGE = 'cuboid_mapping'
# Debian's folder of libraries for one kind of processor.
ARCHITECTURE = sysconfig.get_config_var('MULTIARCH')
# Without optimization, and a library in one unit.
QUICKLY = '-DCMAKE_CXX_FLAGS_RELEASE=-O0', '-DCUBOID_MAPPING_UNITY=WHOLE'


def run(*command, **options):
    """Output of a program; fails with it if the program fails."""
    done = subprocess.run([str(part) for part in command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                          universal_newlines=True, **options)
    if done.returncode != 0:
        raise AssertionError(f'{command} ended with {done.returncode}:\n{done.stdout}')
    return done.stdout


def read_text(path):
    try:
        return path.read_text()
    except OSError:  # A process that has ended.
        return ''


def without_devel(variable):
    """Entries of a path in the environment; without the devel space, where everything would be found, too."""
    paths = [path for path in os.environ.get(variable, '').split(':') if path]
    return [path for path in paths if not {DEVEL, SOURCE} & {pathlib.Path(path), *pathlib.Path(path).parents}]


class Layout:
    """What users do with the installed package, wherever its files lie."""
    lib_dir = 'lib'

    @classmethod
    def setUpClass(cls):
        cls.root = pathlib.Path(tempfile.mkdtemp(prefix='cuboid_test_'))
        cls.addClassCleanup(shutil.rmtree, cls.root)
        egg_info = SOURCE / 'python' / f'{PACKAGE}.egg-info'
        if not egg_info.exists():
            cls.addClassCleanup(shutil.rmtree, egg_info, ignore_errors=True)
        run(CMAKE, '--install', BUILD, env={**os.environ, 'DESTDIR': str(cls.root)})
        cls.use(cls.root / PREFIX.relative_to('/'))

    @classmethod
    def use(cls, space):
        cls.space = space
        cls.share = space / 'share' / PACKAGE
        cls.environment = {**os.environ, 'LD_LIBRARY_PATH': ':'.join([str(space / cls.lib_dir), *without_devel('LD_LIBRARY_PATH')]),
                           'CMAKE_PREFIX_PATH': ':'.join([str(space), *without_devel('CMAKE_PREFIX_PATH')]),
                           'ROS_PACKAGE_PATH': ':'.join([str(space / 'share'), *without_devel('ROS_PACKAGE_PATH')])}

    def test_the_nodelet_and_the_display_are_loaded(self):
        with socket.socket() as free:
            free.bind(('', 0))
            port = free.getsockname()[1]
        environment = {**self.environment, 'ROS_MASTER_URI': f'http://localhost:{port}', 'ROS_LOG_DIR': str(self.root / 'logs'),
                       'LIBGL_ALWAYS_SOFTWARE': '1', 'ROSCONSOLE_STDOUT_LINE_BUFFERED': '1'}  # Debian 13 writes to files at the end only.
        if self.lib_dir != 'lib':  # pluginlib looks in /usr/lib/ARCHITECTURE, too: here in its place.
            (self.root / 'system').mkdir()
            (self.root / 'system/lib').symlink_to(self.space / self.lib_dir)
            environment['CMAKE_PREFIX_PATH'] += f":{self.root / 'system'}"
        library = self.space / self.lib_dir / 'libcuboid_mapping_rviz.so'
        has_display = library.exists() and shutil.which('xvfb-run')
        screen = ['xvfb-run', '-a', '-s', '-screen 0 640x480x24 +extension GLX'] if has_display else []

        def is_loaded():
            if not has_display or 'resolution: 0.1' not in said.read_text():
                return 'resolution: 0.1' in said.read_text()
            maps = (read_text(process / 'maps') for process in pathlib.Path('/proc').glob('[0-9]*'))
            return any(library.name in text and str(self.root) in text for text in maps)

        said = self.root / 'said'
        with said.open('w') as stream:
            launch = subprocess.Popen(
                ['timeout', '-s', 'INT', '120', *screen, 'roslaunch', '-p', str(port), self.share / 'launch/mapping.launch',
                 'nodelet:=true', f'rviz:={bool(has_display)}'], env=environment, stdout=stream, stderr=stream)
        while launch.poll() is None and not is_loaded():
            time.sleep(1)
        loaded = is_loaded()
        launch.send_signal(signal.SIGINT)
        launch.wait()
        self.assertTrue(loaded, said.read_text())
        self.assertNotIn('rviz shows markers', said.read_text())

    def test_python_finds_the_client_the_messages_and_the_module(self):
        (packages,) = self.space.glob(f'lib/python3*/*-packages/{PACKAGE}_client')
        path = f"{packages.parent}:{os.environ.get('PYTHONPATH', '')}"
        environment = dict(self.environment)
        if self.lib_dir == 'lib':  # The module finds its libraries without help; in the other folder the system does.
            del environment['LD_LIBRARY_PATH']
        script = (f'import {PACKAGE}.srv, {PACKAGE}_client, cuboid_map; {PACKAGE}.srv.QueryBox; '
                  f'cuboid_map.Mapper().integrate([(1, 0, 0)]); '
                  f'print({PACKAGE}_client.__file__, cuboid_map._core.__file__)')
        for file in run(sys.executable, '-c', script, env={**environment, 'PYTHONPATH': path}).split():
            self.assertIn(str(self.space), file)
        for name in ('py.typed', '_core.pyi'):
            self.assertTrue((packages.parent / 'cuboid_map' / name).is_file(), name)

    def build(self, project, *options, space=None):
        """Builds a project that uses the installed package. Returns its program."""
        space = space or self.space
        build = self.root / f'build_{project.name}_{space.name}'
        environment = {**self.environment, 'CMAKE_PREFIX_PATH': ':'.join([str(space), *without_devel('CMAKE_PREFIX_PATH')])}
        run(CMAKE, '-S', project, '-B', build, '-Wno-dev', f'-DPYTHON_EXECUTABLE={sys.executable}', *options,
            env=environment)
        run(CMAKE, '--build', build, env=environment)
        (name,) = [path.stem for path in project.glob('*.cpp')]
        (program,) = [path for path in build.rglob(name) if path.is_file()]
        return program

    def test_a_package_follows_the_map_with_the_client_alone(self):
        needed = run('ldd', self.build(SOURCE / 'examples/follow_map'), env=self.environment)
        self.assertIn('libcuboid_mapping_client', needed)
        self.assertNotIn('pcl', needed)
        self.assertNotIn('octo', needed)

    def test_a_component_that_does_not_exist_is_named(self):
        project = self.root / 'asks'
        project.mkdir()
        (project / 'CMakeLists.txt').write_text('cmake_minimum_required(VERSION 3.16)\nproject(asks CXX)\n'
                                                'find_package(cuboid_mapping REQUIRED COMPONENTS clients)\n')
        with self.assertRaisesRegex(AssertionError, r'cuboid_mapping::clients\s+has\s+not\s+been\s+built'):
            self.build(project)

    def test_a_project_without_catkin_uses_the_core_alone(self):
        program = self.build(SOURCE / 'examples/first_map')
        self.assertIn('5 m: occupied', run(program, env=self.environment))
        needed = run('ldd', program, env=self.environment)
        for foreign in ('pcl', 'octo', 'libros', 'boost'):
            self.assertNotIn(foreign, needed)


class InstallSpaceTest(Layout, unittest.TestCase):
    """Everything in PREFIX/lib, as in a workspace and on Noetic."""

    def test_every_program_is_there_with_its_libraries(self):
        names = {path.name for path in (DEVEL / 'lib' / PACKAGE).iterdir()
                 if os.access(path, os.X_OK) and not path.name.startswith('test_')}
        self.assertGreater(len(names), 10)
        programs = self.space / 'lib' / PACKAGE
        self.assertEqual(names - {path.name for path in programs.iterdir()}, set())
        for path in [*programs.iterdir(), *(self.space / 'lib').glob('*.so')]:
            if path.read_bytes()[:2] == b'#!':
                continue
            with self.subTest(path.name):
                needed = run('ldd', path, env=self.environment)
                self.assertNotIn('not found', needed)
                self.assertNotIn(str(DEVEL), needed)
        self.assertIn('Usage', run(programs / 'map_convert', '--help', env=self.environment))

    def test_programs_answer_help_without_a_master(self):
        environment = {**self.environment, 'ROS_MASTER_URI': 'http://localhost:1'}
        for path in (self.space / 'lib' / PACKAGE).iterdir():
            is_script = path.read_bytes()[:2] == b'#!' and path.name != 'check_arguments'  # roslaunch calls that one.
            if is_script or path.name in ('cuboid_mapping_node', 'example_planner', 'simulated_lidar'):
                with self.subTest(path.name):
                    self.assertRegex(run('timeout', '20', path, '--help', env=environment), '(?i)usage: ')

    def test_every_file_is_there_that_is_read_at_run_time(self):
        for folder in ('launch', 'config', 'rviz', 'msg', 'srv'):
            for path in (SOURCE / folder).iterdir():
                installed = self.share / folder / path.name
                with self.subTest(path.name):
                    self.assertEqual(installed.read_bytes(), path.read_bytes())
        for launch in (self.share / 'launch').iterdir():
            for name in re.findall(r'\$\(find cuboid_mapping\)/([^"\' ]+)', launch.read_text()):
                # A program is in lib/: roslaunch looks there, too.
                found = [root / name for root in (self.share, self.space / 'lib' / PACKAGE) if (root / name).is_file()]
                self.assertTrue(found, f'{launch.name} names {name}')
        plugins = (self.share / 'nodelet_plugins.xml').read_text()
        library = re.search(r'<library path="([^"]+)"', plugins).group(1)
        self.assertTrue((self.space / 'lib' / f'{library}.so').is_file(), library)

    def test_each_file_is_in_a_debian_package(self):
        """Benchmarks and the setup files of a workspace are in none. Packages have a folder for the architecture in lib/."""
        lists = [SOURCE / 'debian/not-installed', *(SOURCE / 'debian').glob('*.install')]
        patterns = [line for path in lists for line in path.read_text().splitlines() if not line.startswith('#')]
        carried = set()
        for pattern in patterns:
            pattern = pattern.replace('usr/', '').replace('lib/*/', 'lib/').replace('/python3/dist-', '/python3*/*-')
            carried |= {file for path in self.space.glob(pattern) for file in [path, *path.rglob('*')]}
        makefiles = [*(SOURCE / 'src').glob('*.cmake'), *SOURCE.glob('*/CMakeLists.txt')]
        extras = {name for path in makefiles for names in re.findall(r'install_extras\((.*?)\)', path.read_text(), re.DOTALL)
                  for name in names.split()}
        files = {path for folder in ('bin', 'include', 'lib', 'share') for path in (self.space / folder).rglob('*')
                 if path.name not in extras and '__pycache__' not in path.parts and not path.is_dir()}
        self.assertEqual(files - carried, set())

    def test_a_shell_finds_the_programs_that_a_user_types(self):
        for name in ('bag_to_map', 'map_convert', 'map_fetch', 'map_info', 'map_render'):
            self.assertTrue(os.access(self.space / 'bin' / name, os.X_OK), name)
        self.assertIn('Usage', run(self.space / 'bin/map_info', '--help', env=self.environment))

    def test_another_package_is_built_with_it(self):
        headers = SOURCE / 'include'
        # Ubuntu 20.04's FCL is too old for this part.
        has_fcl = subprocess.run(['pkg-config', '--atleast-version=0.6', 'fcl'], check=False).returncode == 0
        for path in headers.rglob('*.h'):
            is_there = (self.space / 'include' / path.relative_to(headers)).is_file()
            self.assertEqual(is_there, has_fcl or path.name != 'fcl_obstacles.h', path.name)
        # The default of some compilers; the exports of cuboid_mapping require C++17.
        program = self.build(SOURCE / 'test/install/client', '-DCMAKE_CXX_STANDARD=14')
        self.assertEqual(run(program, self.root / 'map.ot', env=self.environment).split()[-1], 'OcTree')

    def test_a_machine_that_only_calls_services(self):
        """Without the node's dependencies, in a workspace; with static libraries, whose dependencies users must find."""
        absent = [f'-DCMAKE_DISABLE_FIND_PACKAGE_{name}=ON'
                  for name in ('PCL', 'octomap', 'PNG', 'Boost', 'nodelet', 'yaml-cpp')]
        workspace, space = self.root / 'workspace', self.root / 'services_space'
        (workspace / 'src').mkdir(parents=True)
        (workspace / 'src' / PACKAGE).symlink_to(SOURCE)
        (workspace / 'src/follow_map').symlink_to(SOURCE / 'examples/follow_map')
        environment = {**self.environment, 'CMAKE_PREFIX_PATH': ':'.join(without_devel('CMAKE_PREFIX_PATH')),
                       'ROS_LANG_DISABLE': 'genlisp:geneus:gennodejs'}  # As scripts/build.
        options = ['--cmake-args', '-DCUBOID_MAPPING_NODE=OFF', '-DBUILD_SHARED_LIBS=OFF', '-DCUBOID_MAPPING_PYTHON=OFF',
                   '-DCATKIN_ENABLE_TESTING=OFF', *QUICKLY, f'-DPYTHON_EXECUTABLE={sys.executable}', *absent]
        output = run('catkin_make_isolated', '-C', workspace, '--install', '--install-space', space, *options, env=environment)
        self.assertIn('cuboid_mapping: libraries core no_return io client', output)
        self.assertEqual(list(space.glob('lib/*.so')), [])
        self.assertTrue((space / 'include' / PACKAGE / 'QueryBox.h').is_file())
        self.assertTrue(list(space.glob(f'lib/python3*/*-packages/{PACKAGE}/srv/_QueryBox.py')))

        needed = run('ldd', workspace / 'devel_isolated/follow_map/lib/follow_map/follow_map', env=self.environment)
        self.assertIn('libroscpp', needed)
        for foreign in (PACKAGE, 'pcl', 'octo', 'png'):
            self.assertNotIn(foreign, needed)
        program = self.build(SOURCE / 'examples/from_bt', *absent, space=space)
        self.assertIn('occupied voxels', run(program, SOURCE / 'test/data/wall.bt', env=self.environment))
        # As one project: what one package finds of the other when CMake runs. The target compiles nothing.
        self.assertIn('cuboid_mapping: libraries', run('catkin_make', '-C', workspace, 'clean', *options, env=environment))


@unittest.skipUnless(ARCHITECTURE, 'a system without such folders')
class DebianLayoutTest(Layout, unittest.TestCase):
    """Libraries and what CMake finds in /usr/lib/ARCHITECTURE."""
    lib_dir = f'lib/{ARCHITECTURE}'

    @classmethod
    def setUpClass(cls):
        """Configures as debian/rules does, and installs what is built already."""
        super().setUpClass()
        build, plain = cls.root / 'build', cls.space
        environment = {**cls.environment, 'CMAKE_PREFIX_PATH': ':'.join(without_devel('CMAKE_PREFIX_PATH')),
                       'ROS_LANG_DISABLE': 'genlisp:geneus:gennodejs'}
        run(CMAKE, '-S', SOURCE, '-B', build, '-Wno-dev', '-DCMAKE_INSTALL_PREFIX=/usr', f'-DCMAKE_INSTALL_LIBDIR={cls.lib_dir}',
            '-DCATKIN_BUILD_BINARY_PACKAGE=ON', '-DCMAKE_SKIP_RPATH=ON', '-DCATKIN_ENABLE_TESTING=OFF',
            f'-DCATKIN_DEVEL_PREFIX={build}/devel', f'-DPYTHON_EXECUTABLE={sys.executable}', env=environment)
        for path in plain.rglob('*'):
            folder = cls.lib_dir if path.parent == plain / 'lib' else path.parent.relative_to(plain)
            copy = build / 'devel' / folder / path.name
            if not copy.exists() and not path.is_dir():
                copy.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(path, copy, follow_symlinks=False)
        run(CMAKE, '--install', build, env={**environment, 'DESTDIR': str(cls.root / 'debian')})
        cls.use(cls.root / 'debian/usr')
        (cls.space / '.catkin').touch()  # ROS knows /usr without this mark of a workspace.

    def test_show_map_finds_the_display(self):
        script = f"import runpy; print(runpy.run_path('{SOURCE}/python/show_map')['has_display']())"
        self.assertEqual(run(sys.executable, '-c', script, env={**self.environment, 'CMAKE_PREFIX_PATH': ''}).strip(),
                         str((self.space / self.lib_dir / 'libcuboid_mapping_rviz.so').exists()))


if __name__ == '__main__':
    del sys.argv[1:6]
    unittest.main()
