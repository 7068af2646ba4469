#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Objects of MoveIt and the map of the running node, with the definitions of MoveIt's messages: it is not in Debian."""
import os
import pathlib
import runpy
import signal
import subprocess
import sys
import tempfile
import unittest
from unittest import mock

import genpy.dynamic
import numpy as np
import rospy
import rostest
import tf2_ros
from geometry_msgs.msg import Point, Pose, Quaternion, TransformStamped

from cuboid_mapping.msg import Box
from cuboid_mapping.srv import GetLocks, SetBox, SetBoxRequest
from cuboid_mapping_client import CuboidMapClient
from cuboid_mapping_client.moveit import PREFIX, MapObjects, SceneBoxes, boxes_in, shapes_of
from waiting import wait_for

NODE = '/cuboid_mapping'
PROGRAM = pathlib.Path(__file__).resolve().parents[2] / 'python/moveit_objects'

# moveit_msgs 0.11 (Noetic), without comments, and what it contains.
COLLISION_OBJECT = '''
std_msgs/Header header
geometry_msgs/Pose pose
string id
object_recognition_msgs/ObjectType type
shape_msgs/SolidPrimitive[] primitives
geometry_msgs/Pose[] primitive_poses
shape_msgs/Mesh[] meshes
geometry_msgs/Pose[] mesh_poses
shape_msgs/Plane[] planes
geometry_msgs/Pose[] plane_poses
string[] subframe_names
geometry_msgs/Pose[] subframe_poses
byte ADD=0
byte REMOVE=1
byte APPEND=2
byte MOVE=3
byte operation
'''
PARTS = {
    'std_msgs/Header': 'uint32 seq\ntime stamp\nstring frame_id',
    'geometry_msgs/Pose': 'Point position\nQuaternion orientation',
    'geometry_msgs/Point': 'float64 x\nfloat64 y\nfloat64 z',
    'geometry_msgs/Quaternion': 'float64 x\nfloat64 y\nfloat64 z\nfloat64 w',
    'object_recognition_msgs/ObjectType': 'string key\nstring db',
    'shape_msgs/SolidPrimitive': 'uint8 BOX=1\nuint8 SPHERE=2\nuint8 CYLINDER=3\nuint8 CONE=4\nuint8 type\n'
                                 'float64[] dimensions\nuint8 BOX_X=0\nuint8 BOX_Y=1\nuint8 BOX_Z=2\n'
                                 'uint8 SPHERE_RADIUS=0\nuint8 CYLINDER_HEIGHT=0\nuint8 CYLINDER_RADIUS=1\n'
                                 'uint8 CONE_HEIGHT=0\nuint8 CONE_RADIUS=1',
    'shape_msgs/Mesh': 'MeshTriangle[] triangles\ngeometry_msgs/Point[] vertices',
    'shape_msgs/MeshTriangle': 'uint32[3] vertex_indices',
    'shape_msgs/Plane': 'float64[4] coef',
}
TEXT = COLLISION_OBJECT + ''.join(f'\n{"=" * 80}\nMSG: {name}\n{text}\n' for name, text in PARTS.items())
CLASSES = genpy.dynamic.generate_dynamic('moveit_msgs/CollisionObject', TEXT)
CollisionObject = CLASSES['moveit_msgs/CollisionObject']
SolidPrimitive = CLASSES['shape_msgs/SolidPrimitive']
Mesh = CLASSES['shape_msgs/Mesh']
QUARTER = Quaternion(0, 0, np.sin(np.pi / 8), np.cos(np.pi / 8))  # 45 degrees about z.


def make_object(name, kind=SolidPrimitive.BOX, sizes=(1, 1, 1), at=(0, 0, 0), turn=Quaternion(0, 0, 0, 1)):
    made = CollisionObject(id=name, operation=CollisionObject.ADD)
    made.header.frame_id = 'map'
    made.pose.orientation.w = 1.0
    made.primitives = [SolidPrimitive(type=kind, dimensions=list(sizes))]
    made.primitive_poses = [Pose(Point(*at), turn)]
    return made


def volume(boxes):
    return np.prod(boxes[:, 3:] - boxes[:, :3], axis=1).sum()


def voxels_of(made, padding=0.0):
    return np.concatenate([boxes_in(matrix, shape, 0.05, padding) for matrix, shape in shapes_of(made)])


class MoveitObjectsTest(unittest.TestCase):

    def test_boxes_have_the_volume_of_the_shape(self):
        for made, wanted in ((make_object('box', sizes=(1, 2, 0.5), at=(0.3, -4, 7)), 1.0),
                             (make_object('turned', sizes=(2, 1, 1), turn=QUARTER), 2.0),
                             (make_object('ball', SolidPrimitive.SPHERE, (1.0,)), 4 / 3 * np.pi),
                             (make_object('can', SolidPrimitive.CYLINDER, (2.0, 0.5), turn=QUARTER), 0.5 * np.pi)):
            boxes = voxels_of(made)
            self.assertAlmostEqual(volume(boxes) / wanted, 1.0, delta=0.05, msg=made.id)

    def test_the_pose_of_the_object_moves_its_shapes(self):
        made = make_object('box')
        made.pose.position.x = 5.0
        boxes = voxels_of(made)
        self.assertAlmostEqual(boxes[:, 0].min(), 4.5)
        self.assertAlmostEqual(boxes[:, 3].max(), 5.5)

    def test_shapes_without_poses_are_where_the_object_is(self):
        """So moveit_commander adds boxes and meshes."""
        made = make_object('box')
        made.meshes = [Mesh(vertices=[Point(-0.5, -0.5, -0.5), Point(0.5, 0.5, 0.5)])]
        made.pose.position.x = 5.0
        made.primitive_poses = []
        boxes = voxels_of(made)
        self.assertAlmostEqual(volume(boxes), 2.0)
        self.assertAlmostEqual(boxes[:, 0].min(), 4.5)
        made.mesh_poses = 2 * [Pose()]
        self.assertRaises(ValueError, shapes_of, made)

    def test_a_mesh_is_the_box_around_it_and_padding_enlarges(self):
        made = make_object('mesh')
        made.primitives, made.primitive_poses = [], []
        made.meshes = [Mesh(vertices=[Point(0, 0, 0), Point(1, 0, 0), Point(0, 1, 1)])]
        made.mesh_poses = [Pose(orientation=Quaternion(0, 0, 0, 1))]
        self.assertAlmostEqual(volume(voxels_of(made)), 1.0)
        self.assertAlmostEqual(volume(voxels_of(made, 0.1)), 1.2 ** 3)

    def test_says_why_a_frame_has_no_place_in_the_map(self):
        with mock.patch.object(sys, 'argv', ['moveit_objects', '--help']):  # Without moveit_msgs.
            transforms = runpy.run_path(str(PROGRAM))['Transforms'](self.client)
        for frame in ('', 'nowhere'):
            self.assertIsInstance(transforms(frame), str)

    def test_a_region_is_a_text_or_a_list(self):
        with mock.patch.object(sys, 'argv', ['moveit_objects', '--help']):
            to_region = runpy.run_path(str(PROGRAM))['to_region']
        self.assertEqual(to_region('-1 -1 0 1 1 2.5'), [-1, -1, 0, 1, 1, 2.5])
        self.assertEqual(to_region([-1, -1, 0, 1, 1, 2.5]), [-1, -1, 0, 1, 1, 2.5])
        self.assertEqual(to_region(''), [])
        for wrong in ('1 2 3', '1, 2, 3, 4, 5, 6', [1, 2], 7, {'x': 1}, [[1], 2, 3, 4, 5, 6]):
            self.assertRaises(SystemExit, to_region, wrong)

    def test_refuses_what_has_no_end(self):
        made = make_object('plane')
        made.planes = [CLASSES['shape_msgs/Plane']()]
        self.assertRaises(ValueError, shapes_of, made)
        self.assertRaises(ValueError, voxels_of, make_object('all', sizes=(1e6, 1e6, 1e6)))

    def setUp(self):
        rospy.wait_for_service(NODE + '/set_box', 60.0)
        self.set_box = rospy.ServiceProxy(NODE + '/set_box', SetBox)
        self.get_locks = rospy.ServiceProxy(NODE + '/get_locks', GetLocks)
        self.set_box(boxes=[Box(Point(-2, -2, -2), Point(2, 2, 2))], occupancy=SetBoxRequest.OCCUPIED)
        self.client = CuboidMapClient(NODE)
        self.addCleanup(self.client.close)
        self.assertTrue(self.client.wait_for_map(60.0))
        self.objects = MapObjects(self.set_box, lambda frame: np.eye(4) if frame == 'map' else f'no frame {frame}',
                                  0.1, 0.0)

    def free_volume(self):
        """Of the region, once the client has all edits."""
        answer = self.set_box(boxes=[Box(Point(90, 0, 0), Point(91, 1, 1))], occupancy=SetBoxRequest.KEEP)
        self.assertTrue(wait_for(lambda: self.client.revision >= answer.info.revision))
        return self.client.map.query_boxes([(-2, -2, -2, 2, 2, 2)]).free_volume[0]

    def locked_volume(self):
        return sum((b.max.x - b.min.x) * (b.max.y - b.min.y) * (b.max.z - b.min.z) for b in self.get_locks().boxes)

    def test_an_object_is_free_and_locked_while_it_is_known(self):
        self.assertIsNone(self.objects.take(make_object('table', sizes=(1, 1, 0.4))))
        self.assertAlmostEqual(self.free_volume(), 0.4)
        self.assertAlmostEqual(self.locked_volume(), 0.4)
        self.assertIsNone(self.objects.take(make_object('cup', sizes=(0.4, 0.4, 1))))
        self.assertAlmostEqual(self.locked_volume(), 0.4 + 0.16 * 0.6)
        self.assertIsNone(self.objects.take(CollisionObject(id='cup', operation=CollisionObject.REMOVE)))
        self.assertAlmostEqual(self.locked_volume(), 0.4, msg='the table is still there')
        self.assertIsNone(self.objects.take(make_object('table', sizes=(1, 1, 0.4), at=(0, 0, 1))))
        self.assertAlmostEqual(self.locked_volume(), 0.4, msg='it has moved')
        self.assertIsNone(self.objects.take(CollisionObject(operation=CollisionObject.REMOVE)))
        self.assertEqual(self.locked_volume(), 0.0)

    def test_one_bad_object_does_not_cost_the_others(self):
        self.assertIsNone(self.objects.take(make_object('table', sizes=(1, 1, 0.4))))
        for bad in (make_object('nowhere', at=(np.nan, 0, 0)), make_object('turned', turn=Quaternion(np.nan, 0, 0, 1)),
                    make_object('infinite', sizes=(1, np.inf, 1)), make_object('short', SolidPrimitive.SPHERE, ()),
                    make_object('flat', sizes=(1,)),
                    make_object('far', at=(1e12, 0, 0))):
            self.assertIsNotNone(self.objects.take(bad), bad.id)
        self.assertIsNone(self.objects.take(make_object('cup', sizes=(0.4, 0.4, 1))))
        self.assertIsNone(self.objects.take(CollisionObject(id='cup', operation=CollisionObject.REMOVE)))
        self.assertAlmostEqual(self.locked_volume(), 0.4)
        self.assertIsNone(self.objects.take(CollisionObject(operation=CollisionObject.REMOVE)))
        self.assertEqual(self.locked_volume(), 0.0)

    def test_an_object_that_comes_twice_is_one_and_stays_locked(self):
        calls = []
        objects = MapObjects(lambda **request: calls.append(request['lock']) or self.set_box(**request),
                             lambda frame: np.eye(4), 0.1, 0.0)
        for operation in (CollisionObject.ADD, CollisionObject.ADD, CollisionObject.APPEND):
            made = make_object('table', sizes=(1, 1, 0.4))
            made.operation = operation
            self.assertIsNone(objects.take(made))
            self.assertAlmostEqual(self.locked_volume(), 0.4)
        self.assertTrue(all(calls), 'it is never unlocked')
        self.assertIsNone(objects.take(CollisionObject(id='table', operation=CollisionObject.REMOVE)))
        self.assertEqual(self.locked_volume(), 0.0)

    def test_a_move_without_shapes_moves_the_known_ones(self):
        made = make_object('table', sizes=(1, 1, 0.4), at=(0, 0, 0.3))
        self.assertIsNone(self.objects.take(made))
        move = CollisionObject(id='table', operation=CollisionObject.MOVE)
        move.header.frame_id = 'map'
        move.pose.position.x = 1.0
        self.assertIsNone(self.objects.take(move))
        self.assertAlmostEqual(self.locked_volume(), 0.4)
        self.assertAlmostEqual(min(b.min.x for b in self.get_locks().boxes), 0.5)
        self.assertAlmostEqual(min(b.min.z for b in self.get_locks().boxes), 0.1)
        move.primitive_poses = [Pose(Point(0, 0, 1), Quaternion())]
        self.assertIsNone(self.objects.take(move))
        self.assertAlmostEqual(self.locked_volume(), 0.4)
        self.assertAlmostEqual(min(b.min.z for b in self.get_locks().boxes), 0.8)
        move.primitive_poses *= 2
        self.assertIn('2 poses for 1 shapes', self.objects.take(move))
        move.id = 'unknown'
        self.assertIn('unknown object', self.objects.take(move))
        self.assertIsNone(self.objects.take(CollisionObject(operation=CollisionObject.REMOVE)))

    def test_the_program_unlocks_at_its_end(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        for package, name in (('moveit_msgs', 'CollisionObject'), ('shape_msgs', 'SolidPrimitive')):
            path = pathlib.Path(folder.name, package)
            path.mkdir()
            (path / '__init__.py').touch()
            (path / 'msg.py').write_text(f'from test_moveit_objects import {name}\n')
        paths = [folder.name, str(pathlib.Path(__file__).resolve().parent), os.environ['PYTHONPATH']]
        broadcaster = tf2_ros.StaticTransformBroadcaster()
        transform = TransformStamped(child_frame_id='robot')
        transform.header.frame_id = 'map'
        transform.transform.rotation.w = 1.0
        broadcaster.sendTransform(transform)
        publisher = rospy.Publisher('collision_object', CollisionObject, queue_size=1, latch=True)
        publisher.publish(make_object('table', sizes=(1, 1, 0.4)))
        program = subprocess.Popen([sys.executable, str(PROGRAM), '__name:=bridge'],
                                   env={**os.environ, 'PYTHONPATH': os.pathsep.join(paths)})
        self.addCleanup(program.kill)
        self.assertTrue(wait_for(lambda: self.locked_volume() > 0.3))
        program.send_signal(signal.SIGINT)
        program.wait(30.0)
        self.assertEqual(self.locked_volume(), 0.0)

    def test_says_what_it_cannot_do(self):
        lost = make_object('lost')
        lost.header.frame_id = 'nowhere'
        self.assertEqual(self.objects.take(lost), 'no frame nowhere')
        self.assertIn('with 0 dimensions, not 1', self.objects.take(make_object('short', SolidPrimitive.SPHERE, ())))
        self.assertIn('more than', self.objects.take(make_object('all', sizes=(1e6, 1e6, 1e6))))
        self.assertIsNone(self.objects.take(make_object(PREFIX + '0_0_0')), 'one of the map itself')
        self.assertEqual(self.locked_volume(), 0.0)

    def test_the_scene_gets_boxes_and_then_differences(self):
        sent = []
        scene = SceneBoxes(sent.append, CollisionObject, SolidPrimitive)
        scene.update(self.client.copy(), (-3, -3, -3, 3, 3, 3))
        self.assertTrue(sent)
        known = {}

        def follow(messages):
            for message in messages:
                if message.operation == CollisionObject.REMOVE:
                    del known[message.id]
                else:
                    self.assertNotIn(message.id, known)
                    known[message.id] = message

        follow(sent)
        total = sum(np.prod(message.primitives[0].dimensions) for message in known.values())
        occupied = self.client.map.query_boxes([(-3, -3, -3, 3, 3, 3)]).occupied_volume[0]
        self.assertAlmostEqual(total, occupied)
        del sent[:]
        scene.update(self.client.copy(), (-3, -3, -3, 3, 3, 3))
        self.assertEqual(sent, [], 'nothing has changed')
        self.set_box(boxes=[Box(Point(1.5, 1.5, 1.5), Point(2, 2, 2))], occupancy=SetBoxRequest.FREE)
        self.free_volume()
        scene.update(self.client.copy(), (-3, -3, -3, 3, 3, 3))
        follow(sent)
        total = sum(np.prod(message.primitives[0].dimensions) for message in known.values())
        self.assertAlmostEqual(total, self.client.map.query_boxes([(-3, -3, -3, 3, 3, 3)]).occupied_volume[0])
        again = []
        scene.repeat(again.append)
        self.assertEqual({message.id for message in again}, set(known))


if __name__ == '__main__':
    rospy.init_node('test_moveit_objects')
    rostest.rosrun('cuboid_mapping', 'moveit_objects', MoveitObjectsTest)
