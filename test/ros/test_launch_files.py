#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Checks launch files and rviz configurations. Needs no master."""
import contextlib
import importlib.machinery
import importlib.util
import io
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest
from unittest import mock

import yaml
from roslaunch.arg_dump import dump_args
from sensor_msgs.msg import Image, PointCloud2, PointField

ROOT = pathlib.Path(__file__).resolve().parents[2]
os.environ['ROS_PACKAGE_PATH'] = f"{ROOT}:{os.environ.get('ROS_PACKAGE_PATH', '')}"


def roslaunch(*arguments):
    return subprocess.run(['roslaunch', *map(str, arguments)], capture_output=True, text=True,
                          check=True).stdout


def describe_arguments(file):
    """What `roslaunch --ros-args` prints, without another start of roslaunch."""
    with contextlib.redirect_stdout(io.StringIO()) as text:
        dump_args([str(file)])
    return text.getvalue()


def topics_of(display):
    """All topics in a part of an rviz configuration."""
    if isinstance(display, dict):
        for key, value in display.items():
            if key in ('Topic', 'Marker Topic'):
                yield value
            else:
                yield from topics_of(value)
    elif isinstance(display, list):
        for entry in display:
            yield from topics_of(entry)


def load_script(name):
    loader = importlib.machinery.SourceFileLoader(name, str(ROOT / 'python' / name))
    script = importlib.util.module_from_spec(importlib.util.spec_from_loader(name, loader))
    loader.exec_module(script)
    return script


class LaunchFilesTest(unittest.TestCase):

    def test_only_what_is_required_is_listed_so(self):
        for file in sorted((ROOT / 'launch').glob('*.launch')):
            text = describe_arguments(file)
            self.assertNotIn('undocumented', text, file.name)
            self.assertNotRegex(text, r'\S   +\S', f'{file.name}: a line break in an argument')
            required = text.partition('Optional Arguments:')[0]
            names = [line.split(':')[0].strip() for line in required.splitlines()[1:]]
            if file.name == 'mapping.launch':
                self.assertEqual(file.read_text().count('<arg '), 10)
            self.assertEqual(names, {'replay.launch': ['bag'], 'merge_maps.launch': ['robots']}.get(file.name, []), file.name)

    def test_as_node_and_as_nodelet(self):
        mapping = ROOT / 'launch/mapping.launch'
        self.assertEqual(roslaunch('--nodes', mapping, 'rviz:=true').split(), ['/cuboid_mapping', '/show_map'])
        self.assertEqual(roslaunch('--nodes', mapping, 'nodelet:=true').split(), ['/cuboid_mapping_manager', '/cuboid_mapping'])
        self.assertEqual(roslaunch('--nodes', mapping, 'nodelet:=/camera/manager').split(), ['/cuboid_mapping'])
        words = roslaunch('--args', '/cuboid_mapping', mapping, 'nodelet:=/camera/manager').split()
        self.assertEqual(words[1:4], ['load', 'cuboid_mapping/MappingNodelet', '/camera/manager'])

    def test_what_is_set_around_the_include_holds(self):
        dump, words = self.load_around('', '')
        self.assertIn('cloud_in:=/robot1/points', words)
        self.assertIn('/tf:=/robot1/tf', words)
        self.assertEqual({key: value for key, value in dump.items() if key.startswith('/robot1/')},
                         {'/robot1/cuboid_mapping/resolution': 0.3, '/robot1/cuboid_mapping/defaults/resolution': 0.1,
                          '/robot1/cuboid_mapping/defaults/sensor_model/max_range': 30.0,
                          '/robot1/cuboid_mapping/defaults/sensor_model/keep_surfaces': True})
        dump, words = self.load_around('<arg name="cloud" value="/scan"/>', '<arg name="type" value="laser_scan"/>')
        self.assertIn('cloud_in:=/scan', words)
        self.assertEqual(dump['/robot1/cuboid_mapping/type'], 'laser_scan')

    def test_dynamic_is_one_switch_that_other_settings_override(self):
        dump, _ = self.load_around('<arg name="dynamic" value="true"/>', '<arg name="sensor" value="velodyne"/>')
        defaults = {key.partition('/defaults/')[2]: value for key, value in dump.items() if '/defaults/' in key}
        expected = {}
        for file in ('velodyne', 'dynamic'):
            content = yaml.safe_load((ROOT / f'config/{file}.yaml').read_text())
            expected.update({f'sensor_model/{key}': value for key, value in content.pop('sensor_model').items()})
            expected.update(content)
        self.assertEqual(defaults, expected)
        self.assertIn('moving_points', expected)

    def load_around(self, *arguments):
        """Parameters, and the words of the node's command line, of mapping.launch in a robot's group."""
        with tempfile.NamedTemporaryFile('w', suffix='.launch') as file:
            file.write(f'''<launch><group ns="robot1">
                <remap from="/tf" to="/robot1/tf"/><remap from="cloud_in" to="/robot1/points"/>
                <param name="cuboid_mapping/resolution" value="0.3"/>
                <include file="{ROOT}/launch/mapping.launch">{"".join(arguments)}</include></group></launch>''')
            file.flush()
            return (yaml.safe_load(roslaunch('--dump-params', file.name)),
                    roslaunch('--args', '/robot1/cuboid_mapping', file.name).split())

    def test_a_window_needs_no_complete_file(self):
        def load(**arguments):
            return yaml.safe_load(roslaunch('--dump-params', ROOT / 'launch/window.launch',
                                            *(f'{name}:={value}' for name, value in arguments.items())))

        dump = load(robot_frame='base', file='/data/site.sqlite', params_file=ROOT / 'config/default.yaml')
        self.assertEqual(dump['/cuboid_mapping/window/frame'], 'base')
        self.assertEqual(dump['/cuboid_mapping/window/outside'], 'keep')
        self.assertEqual(dump['/cuboid_mapping/window/file'], '/data/site.sqlite')
        dump = load()
        for key, value in (('frame', 'base_link'), ('outside', 'forget')):  # A file of the user may say otherwise.
            self.assertEqual(dump[f'/cuboid_mapping/defaults/window/{key}'], value)
            self.assertNotIn(f'/cuboid_mapping/window/{key}', dump)

    def test_unknown_arguments_are_refused(self):
        for file, wrong, cure in (('mapping.launch', 'max_rang:=3', 'mean max_range:=?'), ('replay.launch', 'cloudd:=/points', 'mean cloud:=?'),
                                  ('mapping.launch', 'manager:=/camera', 'nodelet:=MANAGER'),
                                  ('merge_maps.launch', 'resolutoin:=0.2', 'mean resolution:=?'),
                                  ('octomap_server_compat.launch', 'max_rang:=3', 'mean max_range:=?')):
            right = {'replay.launch': 'bag:=x.bag', 'merge_maps.launch': 'robots:=/robot1'}.get(file, 'cloud:=/x')
            for call in ([ROOT / 'launch' / file], ['cuboid_mapping', file]):
                end = subprocess.run(['roslaunch', '--nodes', *map(str, call), right, wrong], capture_output=True, text=True)
                self.assertNotEqual(end.returncode, 0)
                self.assertIn(f'{file} has no argument {wrong.partition(":=")[0]}', end.stderr)
                self.assertIn(cure, end.stderr)

    def test_a_transform_is_published(self):
        replay = ROOT / 'launch/replay.launch'
        words = roslaunch('--args', '/replay_transforms', replay, 'bag:=x.bag', 'tf:=/robot1/tf',
                          'transform:=map base 0 0 1 0 0 0; base lidar 1 0 0 0 0 0 1').split()
        self.assertIn('/tf_static:=/robot1/tf_static', words)
        self.assertEqual(words[1:9], ['map', 'base', '0', '0', '1', '0', '0', '0;'])
        self.assertIn('/tf:=/robot1/tf', roslaunch('--args', '/cuboid_mapping', replay, 'bag:=x.bag', 'tf:=/robot1/tf'))

    def test_the_type_of_the_sensor_is_an_argument(self):
        dump = roslaunch('--dump-params', ROOT / 'launch/replay.launch', 'bag:=x.bag', 'type:=laser_scan')
        self.assertEqual(yaml.safe_load(dump)['/cuboid_mapping/type'], 'laser_scan')

    def test_a_robot_that_waits_for_paths_begins_in_free_space(self):
        call = ('--dump-params', ROOT / 'launch/explore.launch')
        self.assertIn('/cuboid_mapping/start_free', yaml.safe_load(roslaunch(*call, 'explore:=false')))
        self.assertNotIn('/cuboid_mapping/start_free', yaml.safe_load(roslaunch(*call)))

    def test_a_sensor_has_its_topic_and_its_parameters(self):
        mapping = ROOT / 'launch/mapping.launch'
        for sensor, topic in (('velodyne', '/velodyne_points'), ('ouster', '/ouster/points'), ('livox', '/livox/lidar'),
                              ('realsense', '/camera/depth/image_rect_raw')):
            words = roslaunch('--args', '/cuboid_mapping', mapping, f'sensor:={sensor}').split()
            self.assertIn(f'cloud_in:={topic}', words)
            dump = yaml.safe_load(roslaunch('--dump-params', mapping, f'sensor:={sensor}', 'resolution:=0.3'))
            preset = yaml.safe_load((ROOT / f'config/{sensor}.yaml').read_text())
            self.assertEqual(dump['/cuboid_mapping/defaults/resolution'], preset['resolution'])
            self.assertEqual(dump['/cuboid_mapping/defaults/sensor_model/max_range'], preset['sensor_model']['max_range'])
            self.assertEqual(dump['/cuboid_mapping/resolution'], 0.3)
            self.assertEqual(dump.get('/cuboid_mapping/type'), 'depth_image' if sensor == 'realsense' else None)
        for sensor in ('ouster', 'realsense'):
            call = (mapping, f'sensor:={sensor}', 'cloud:=/mine')
            self.assertIn('cloud_in:=/mine', roslaunch('--args', '/cuboid_mapping', *call).split())
            self.assertNotIn('/cuboid_mapping/type', yaml.safe_load(roslaunch('--dump-params', *call)))

    def test_topics_of_rviz_follow_its_namespace(self):
        files = sorted((ROOT / 'rviz').glob('*.rviz'))
        self.assertGreaterEqual(len(files), 3)
        for file in files:
            topics = list(topics_of(yaml.safe_load(file.read_text())))
            self.assertGreaterEqual(len(topics), 3, file.name)
            for topic in topics:
                self.assertFalse(topic.startswith('/'), f'{file.name}: {topic}')

    def test_topics_of_the_layout_for_foxglove_exist(self):
        layout = json.loads((ROOT / 'config/foxglove.json').read_text())
        panels = layout['configById']
        self.assertEqual({layout['layout']['first'], layout['layout']['second']}, set(panels))
        shown = [topic for panel in panels.values() for topic in panel.get('topics', {})]
        shown += [panel['topicToRender'] for panel in panels.values() if 'topicToRender' in panel]
        self.assertGreaterEqual(len(shown), 4)
        names = (ROOT / 'src/cuboid_mapping/ros/middleware/names.h').read_text()
        topics = re.findall(r'k\w+Topic\[\] = *"(\w+)"', names.replace('\n', ' ')) + ['diagnostics']
        for topic in shown:
            self.assertIn(topic.lstrip('/'), topics)

    def test_rviz_gets_a_configuration_whose_path_has_spaces(self):
        for name in ('explore', 'fleet_demo', 'planner'):
            (node,) = re.findall(r'<node if="\$\(arg rviz\)"[^>]*>', (ROOT / f'launch/{name}.launch').read_text())
            self.assertIn("'$(arg rviz_config)'", node)

    def test_a_map_whose_frame_is_not_known_is_shown_in_map(self):
        map_view = load_script('map_view')
        with tempfile.TemporaryDirectory() as folder, mock.patch.object(map_view, 'subprocess') as subprocesses:
            subprocesses.run.return_value = mock.Mock(returncode=0, stdout='frame:        not known\nresolution:   0.1 m\n')
            subprocesses.check_output.return_value = f'{ROOT}\n'
            info = map_view.describe('map.cuboids')
            self.assertEqual(info, {'resolution': '0.1 m'})
            config = yaml.safe_load(pathlib.Path(map_view.configure('map.cuboids', info, folder)).read_text())
            self.assertEqual(config['Visualization Manager']['Global Options']['Fixed Frame'], 'map')

    def test_rviz_is_started_again_when_it_crashes(self):
        show_map = load_script('show_map')
        with tempfile.TemporaryDirectory() as folder:
            rviz = pathlib.Path(folder) / 'rviz'
            for num_crashes, last, num_starts, status in ((0, 'exit 0', 1, 0), (0, 'exit 1', 1, 1), (2, 'exit 0', 3, 0),
                                                          (9, 'exit 0', 3, 139)):
                starts = pathlib.Path(folder) / f'starts-{num_crashes}-{last}'
                rviz.write_text(f'''#!/bin/bash
echo "$*" >>"{starts}"
[ $(wc -l <"{starts}") -gt {num_crashes} ] || kill -SEGV $$
{last}
''')
                rviz.chmod(0o755)
                copies = tempfile.mkdtemp(dir=folder)
                end = subprocess.run(['bash', '-c', show_map.RUN_RVIZ, 'show_map', copies, rviz, '-d', 'a file'],
                                     capture_output=True, check=False)
                self.assertFalse(pathlib.Path(copies).exists())
                self.assertEqual(end.returncode, status)
                self.assertEqual(starts.read_text().splitlines(), num_starts * ['-d a file'])

    def test_a_first_message_that_cannot_be_read_leaves_the_camera(self):
        show_map = load_script('show_map')
        cloud = PointCloud2(point_step=4, data=bytes(8), fields=[PointField('x', 8, 7, 1), PointField('y', 0, 7, 1), PointField('z', 0, 7, 1)])
        for message in (cloud, PointCloud2(), PointCloud2(fields=cloud.fields), Image(encoding='32FC1', data=bytes(3))):
            data = io.BytesIO()
            message.serialize(data)
            raw = mock.Mock(_connection_header={'type': message._type}, _buff=data.getvalue())
            with mock.patch.object(show_map.rospy, 'wait_for_message', return_value=raw), \
                    mock.patch.object(show_map.rospy, 'logwarn') as warn:
                self.assertIsNone(show_map.wait_for_sensor())
                self.assertEqual(warn.call_count, 1)

    def test_show_map_can_be_stopped_while_it_waits_for_the_sensor(self):
        show_map = load_script('show_map')
        with mock.patch.object(show_map, 'rospy') as rospy, mock.patch.object(show_map.os, 'execvp') as execvp, \
                mock.patch.object(show_map, 'adapt', side_effect=KeyboardInterrupt):
            rospy.myargv.return_value = ['show_map']
            show_map.main()  # Raises nothing.
            execvp.assert_not_called()

    def test_what_is_shown_is_what_the_node_has(self):
        show_map = load_script('show_map')
        with tempfile.TemporaryDirectory() as folder, mock.patch.object(show_map, 'rospy') as rospy, \
                mock.patch.object(show_map.rospkg, 'RosPack') as packages, mock.patch.dict(os.environ, {'CMAKE_PREFIX_PATH': folder}):
            parameters = {'cuboid_mapping/defaults/frame_id': '/odom'}
            rospy.get_param.side_effect = parameters.get
            rospy.get_published_topics.return_value = []
            rospy.resolve_name.return_value = '/cloud_in'
            packages.return_value.get_path.return_value = f'{folder}/share/cuboid_mapping'
            for place in (None, 'lib/x86_64-linux-gnu'):  # Where Debian has libraries.
                if place:
                    (pathlib.Path(folder) / place).mkdir(parents=True)
                    (pathlib.Path(folder) / place / 'libcuboid_mapping_rviz.so').touch()
                arguments = mock.Mock(config=ROOT / 'rviz/mapping.rviz', follow='nothing', server='cuboid_mapping')
                manager = yaml.safe_load(pathlib.Path(show_map.adapt(arguments)).read_text())['Visualization Manager']
                self.assertEqual(manager['Global Options']['Fixed Frame'], 'odom')
                displays = {display['Class']: display for display in manager['Displays']}
                self.assertEqual(show_map.DISPLAY in displays, place is not None)
                self.assertEqual('rviz/MarkerArray' in displays, place is None)
                self.assertEqual(rospy.logwarn.call_count, 1)
            self.assertEqual(displays[show_map.DISPLAY]['Server'], 'cuboid_mapping')

    def test_a_sensor_that_nobody_publishes_yet_is_shown_by_its_type(self):
        show_map = load_script('show_map')
        for kind, classes in (('laser_scan', ['rviz/LaserScan']), ('point_cloud', ['rviz/PointCloud2']), ('depth_image', [])):
            displays = [{'Topic': 'cloud_in', 'Class': 'rviz/PointCloud2'}]
            with mock.patch.object(show_map, 'rospy') as rospy:
                rospy.get_published_topics.return_value = []
                rospy.resolve_name.return_value = '/scan'
                rospy.get_param.return_value = kind
                show_map.show_sensor(displays, 'cuboid_mapping')
            self.assertEqual([display['Class'] for display in displays], classes)


if __name__ == '__main__':
    sys.dont_write_bytecode = True  # Of python/show_map.
    unittest.main()
