#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Runs the calls in doc/planner_guide.md and README.md, and the programs that follow the map."""
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

import rospy
import rosservice
import rostest
import yaml

ROOT = pathlib.Path(__file__).resolve().parents[2]
CALL = re.compile(r"^\$ rosservice call (\S+) '(.*)'\n((?:.*\n)*?)(?=\n|\Z|\$)", re.MULTILINE)


def read_calls():
    """(service, request, answer) of each call, in the order of the guide."""
    text = (ROOT / 'doc/planner_guide.md').read_text()
    blocks = '\n'.join(line[4:] for line in text.split('\n') if line.startswith('    ') or not line)
    return [(name, yaml.safe_load(request), yaml.safe_load(answer)) for name, request, answer in CALL.findall(blocks)]


def plain(value):
    """A part of a message as numbers, lists and dicts; bytes of a bool[] or uint8[] as numbers."""
    if hasattr(value, '__slots__'):
        return {name: plain(getattr(value, name)) for name in value.__slots__}
    return [plain(part) for part in value] if isinstance(value, (list, tuple, bytes)) else value


class PlannerGuideTest(unittest.TestCase):

    def expect_part(self, shown, given, where):
        """The answer has all fields that the guide shows, numbers to three decimals."""
        if isinstance(shown, dict):
            for name in shown:
                self.expect_part(shown[name], given[name], f'{where}/{name}')
        elif isinstance(shown, list):
            if shown and shown[-1] == '...':
                shown, given = shown[:-1], given[:len(shown) - 1]
            self.assertEqual(len(shown), len(given), where)
            for number, part in enumerate(shown):
                self.expect_part(part, given[number], f'{where}[{number}]')
        elif isinstance(given, (int, float)):
            self.assertAlmostEqual(float(shown), float(given), 3, where)
        elif shown != '...':
            self.assertEqual(shown, given, where)

    def test_calls_give_the_answers_that_are_shown(self):
        calls = read_calls()
        self.assertGreater(len(calls), 10)
        for name, request, answer in calls:
            rospy.wait_for_service(name, 20)
            service = rosservice.get_service_class_by_name(name)
            message = service._request_class()
            rosservice.genpy.message.fill_message_args(message, [request])
            given = plain(rospy.ServiceProxy(name, service)(message))
            self.assertTrue(given.get('info', given)['success'], given)
            with self.subTest(name):
                self.expect_part(answer, given, name)
        self.follow()
        self.watch()
        self.fetch()
        self.paste()

    def run_program(self, *command, status=0, **options):
        done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, universal_newlines=True,
                              timeout=60, **options)
        self.assertEqual(done.returncode, status, done.stdout)
        return done.stdout

    def follow(self):
        """Other programs see the room that the calls have made."""
        for command in (['rosrun', 'cuboid_mapping', 'test_follow_map'],
                        [sys.executable, str(ROOT / 'examples/follow_map/follow_map.py')]):
            said = self.run_program(*command)
            self.assertRegex(said, r'0\.5 +0\.5 +0\.5')
            self.assertRegex(said, r'3\.5 +0\.5 +0\.5')
        self.explain_what_is_in_the_way()
        (program,) = re.findall(r'^```python ros\n(.*?)^```', (ROOT / 'doc/python.md').read_text(),
                                re.MULTILINE | re.DOTALL)
        said = self.run_program(sys.executable, '-c', program)
        # The number of cuboids is the map's. The callback's thread may print between the words of a line.
        self.assertRegex(said, r'(?<!\d)40(?!\d)')
        self.assertIn('occupied_volume=array([0.1])', said)

    def explain_what_is_in_the_way(self):
        """The example in C++ says why there is no corridor."""
        for occupancy, place in ((2, 'occupied'), (0, 'unknown')):
            box = '{min: {x: 3.4, y: 0.4, z: 0.4}, max: {x: 3.6, y: 0.6, z: 0.6}}'
            self.run_program('rosservice', 'call', '/cuboid_mapping/set_box', f'{{boxes: [{box}], occupancy: {occupancy}}}')
            said = self.run_program('rosrun', 'cuboid_mapping', 'test_follow_map', status=2)
            self.assertIn(f'goal is {place}', said)
            self.run_program('rosservice', 'call', '/cuboid_mapping/undo_edit')

    def watch(self):
        """The node of the tutorial reports the map that it finds. Its box holds no part of the wall."""
        with subprocess.Popen([sys.executable, '-u', str(ROOT / 'examples/follow_map/watch_box.py')],
                              stdout=subprocess.PIPE, universal_newlines=True) as program:
            said = program.stdout.readline()
            program.terminate()
        self.assertRegex(said, r'^revision \d+ occupied m3: 0\.0\n$')

    def fetch(self):
        """The same room as a file, with exact values, and as boxes for a planner."""
        program = ['rosrun', 'cuboid_mapping', 'map_fetch']
        with tempfile.TemporaryDirectory() as folder:
            scene, copy = f'{folder}/room.scene', f'{folder}/room.cuboids'
            self.run_program(*program, scene, '--node', 'cuboid_mapping', '--boxes', '10')
            self.assertIn('box\n0.1 1.2 1', pathlib.Path(scene).read_text())
            self.run_program(*program, copy)
            self.assertRegex(self.run_program('rosrun', 'cuboid_mapping', 'map_info', copy), r'frame: +map\n')
            done = subprocess.run([*program, copy, '--node', '/nobody'], stderr=subprocess.PIPE, universal_newlines=True,
                                  timeout=60, check=False)
            self.assertEqual(done.returncode, 1)
            self.assertIn('nobody serves /nobody/get_map: give the name of the node', done.stderr)
            done = subprocess.run([*program, copy], env={**os.environ, 'ROS_MASTER_URI': 'http://localhost:1'},
                                  stderr=subprocess.PIPE, universal_newlines=True, timeout=60, check=False)
            self.assertEqual(done.returncode, 1)
            self.assertIn('no ROS master answers at http://localhost:1', done.stderr)

    def paste(self):
        """Runs the calls of README and the first guides in a shell."""
        pages = [(ROOT / name).read_text().replace('\\\n', ' ') for name in ('README.md', 'doc/first_map.md', 'doc/plan.md')]
        calls = [call for page in pages for call in re.findall(r'^    (rosservice call .*)$', page, re.MULTILINE)]
        with tempfile.TemporaryDirectory() as folder:
            said = self.run_program('bash', '-ec', '\n'.join(calls), cwd=folder)
            self.assertTrue((pathlib.Path(folder) / 'my.cuboids').is_file(), said)
        self.assertEqual(said.count('success: True'), len(calls), said)
        self.assertIn('unknown_volume', said)
        self.assertGreaterEqual(len(calls), 6)


if __name__ == '__main__':
    rospy.init_node('test_planner_guide')
    rostest.rosrun('cuboid_mapping', 'planner_guide', PlannerGuideTest)
