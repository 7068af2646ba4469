#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Output of scripts/build about packages, sudo, progress and errors.

usage: test_build_script.py SOURCE_DIR
"""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

SOURCE = pathlib.Path(sys.argv[1])
RELEASE = pathlib.Path('/etc/os-release').read_text()


@unittest.skipUnless(re.search('^VERSION_CODENAME=[bt]', RELEASE, re.MULTILINE), 'with apt packages of ROS, so on Debian')
class BuildScript(unittest.TestCase):
    """Runs in a package of its own, with stubs for programs that inspect or change the machine."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = pathlib.Path(folder.name)
        shutil.copytree(SOURCE / 'scripts', self.root / 'scripts')
        self.stub('dpkg-query', 'echo installed')
        self.stub('id', 'echo 1000')

    def stub(self, name, command):
        file = self.root / 'stubs' / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(f'#!/bin/sh\n{command}\n')
        file.chmod(0o755)

    def make_project(self, command):
        (self.root / 'CMakeLists.txt').write_text(
            'cmake_minimum_required(VERSION 3.16)\nproject(example NONE)\n'
            f'add_custom_command(OUTPUT step COMMAND {command} VERBATIM)\n'
            'add_custom_command(OUTPUT last COMMAND true DEPENDS step)\n'
            'add_custom_target(steps ALL DEPENDS last)\n')

    def run_script(self, *command):
        path = f"{self.root / 'stubs'}:{os.environ['PATH']}"
        return subprocess.run([self.root / 'scripts' / command[0], *command[1:]],
                              env={**os.environ, 'PATH': path}, capture_output=True, text=True)

    def build(self, *options):
        return self.run_script('build', *options)

    def test_scripts_explain_themselves_and_do_nothing_else(self):
        for script in ('build', 'test', 'demo', 'docs', 'lint'):
            end = self.run_script(script, '--help')
            self.assertEqual(end.returncode, 0, end.stderr)
            self.assertIn(f'usage: scripts/{script} ', end.stdout)
            self.assertFalse(end.stdout.endswith('pipefail\n'), end.stdout)
        self.assertFalse((self.root / 'build').exists())

    def test_a_script_finds_itself_from_its_folder(self):
        for script in ('build', 'deb', 'demo', 'test'):
            end = subprocess.run([f'./{script}', '--help'], cwd=self.root / 'scripts', capture_output=True, text=True)
            self.assertIn(f'usage: scripts/{script} ', end.stdout, end.stderr)

    def test_the_quick_demo_heeds_its_options_or_refuses_them(self):
        (self.root / 'scripts/build').write_text('#!/bin/sh\n')
        (self.root / 'build').mkdir()
        (self.root / 'build/CMakeCache.txt').touch()
        for program in ('simulated_map', 'map_render'):
            self.stub(f'../devel/lib/cuboid_mapping/{program}', 'echo "$*"')
        self.assertIn('--resolution 0.2', self.run_script('demo', '--quick', '--resolution', '0.2').stdout)
        for more in (['--max-range', '5'], [SOURCE / 'package.xml']):
            end = self.run_script('demo', '--quick', *more)
            self.assertEqual(end.returncode, 1, more)
            self.assertIn('--quick has no bag and no --max-range', end.stderr)

    def test_scripts_refuse_what_they_do_not_know(self):
        for script in ('test', 'demo'):
            end = self.run_script(script, '--nolint')
            self.assertEqual(end.returncode, 1)
            self.assertIn('unknown option --nolint', end.stderr)

    def test_says_what_it_installs_and_why_it_asks_for_a_password(self):
        self.stub('dpkg-query', 'case "$*" in *xvfb*|*zlib*) exit 1 ;; esac; echo installed')
        self.stub('sudo', f'echo "$*" >{self.root}/asked; exit 1')
        end = self.build()
        self.assertNotEqual(end.returncode, 0)
        self.assertIn('installs 2 packages with apt', end.stdout)
        self.assertIn('\n  xvfb zlib1g-dev\n', end.stdout)
        self.assertIn('asks sudo for your password, to install these packages', end.stdout)
        self.assertIn('xvfb zlib1g-dev', (self.root / 'asked').read_text())

    def test_installs_what_is_built_alone(self):
        self.stub('dpkg-query', 'echo not-installed')
        self.stub('sudo', f'echo "$*" >{self.root}/asked; exit 1')
        asked = {}
        for option in ('--library', '--demo', '--all', '--tests'):
            self.assertNotEqual(self.build(option).returncode, 0)
            asked[option] = set((self.root / 'asked').read_text().split())
        self.assertNotIn('libroscpp-dev', asked['--library'])
        self.assertLess(asked['--library'], asked['--demo'])
        for package in ('libopenvdb-dev', 'libopenmpi-dev', 'pybind11-dev', 'librostest-dev', 'doxygen'):
            self.assertNotIn(package, asked['--demo'])
            self.assertIn(package, asked['--all'])
        self.assertEqual(asked['--tests'], asked['--all'])

    def test_shows_one_line_of_progress(self):
        self.make_project('echo chatter')
        end = self.build()
        self.assertEqual(end.returncode, 0, end.stderr)
        said, progress = end.stdout.splitlines()
        self.assertIn('builds node, nodelet, clients, programs and display (--all: ', said)
        self.assertTrue(progress.startswith('scripts/build: building all'), end.stdout)
        self.assertIn('100%', end.stdout)
        self.assertEqual(end.stderr, '')

    def test_progress_is_that_of_the_package_alone(self):
        self.make_project('echo [ 70%] Built target gmock')
        end = self.build()
        self.assertEqual(end.returncode, 0, end.stderr)
        self.assertNotIn('70%', end.stdout)
        self.assertIn('100%', end.stdout)

    def test_what_is_built_is_not_compiled_again_for_the_tests(self):
        self.make_project('true')
        cache = self.root / 'build/CMakeCache.txt'
        self.assertEqual(self.run_script('test').returncode, 1, 'there is no target tests')
        self.assertIn('CUBOID_MAPPING_WERROR:UNINITIALIZED=ON', cache.read_text())
        shutil.rmtree(self.root / 'build')
        self.assertEqual(self.build().returncode, 0)
        self.run_script('test')
        self.assertIn('CATKIN_ENABLE_TESTING:UNINITIALIZED=ON', cache.read_text())
        self.assertNotIn('WERROR', cache.read_text())

    def test_tests_are_built_where_nothing_was_built_before(self):
        self.make_project('true')
        with (self.root / 'CMakeLists.txt').open('a') as project:
            project.write('if(CATKIN_ENABLE_TESTING)\n  add_custom_target(tests)\nendif()\n')
        end = self.build('--all', '--tests')
        self.assertEqual(end.returncode, 0, end.stderr)

    def test_the_library_is_not_compiled_beside_a_build(self):
        self.make_project('true')
        with (self.root / 'CMakeLists.txt').open('a') as project:
            project.write('set(PYTHON_EXECUTABLE /usr/bin/python3 CACHE FILEPATH "")\n'
                          'add_custom_target(map_render)\nadd_custom_target(simulated_map)\n')
        library = self.root / 'build/library'
        self.assertEqual(self.build('--library').returncode, 0)
        self.assertTrue(library.is_dir())
        shutil.rmtree(library)
        self.assertEqual(self.build().returncode, 0)
        self.assertEqual(self.build('--library').returncode, 0)
        self.assertFalse(library.exists())

    def test_a_build_is_kept_for_the_next_call(self):
        for python, is_kept in (('', True), ('PYTHON_EXECUTABLE /usr/bin/python3', True), ('_Python_EXECUTABLE /usr/bin/python3.13', True),
                                ('PYTHON_EXECUTABLE /opt/python3/bin/python3', False)):
            self.make_project('true')
            with (self.root / 'CMakeLists.txt').open('a') as project:
                project.write(f'set({python} CACHE FILEPATH "")\n' if python else '')
            self.assertEqual(self.build().returncode, 0)
            mark = self.root / 'build/mark'
            mark.touch()
            self.assertEqual(self.build().returncode, 0)
            self.assertEqual(mark.exists(), is_kept, python)
            shutil.rmtree(self.root / 'build')

    def test_shows_errors_in_full(self):
        self.make_project('sh -c "echo line 7: no such name >&2; exit 1"')
        end = self.build()
        self.assertEqual(end.returncode, 1)
        self.assertIn('line 7: no such name', end.stderr)
        self.assertIn('all has failed; the whole output is in build/build.log', end.stderr)


if __name__ == '__main__':
    del sys.argv[1:]
    unittest.main()
