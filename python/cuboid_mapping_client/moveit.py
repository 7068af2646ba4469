# SPDX-License-Identifier: BSD-3-Clause
"""Objects of MoveIt's planning scene and a node's map: each knows what the other has.

Imports no package of MoveIt: the class of the messages is given.
"""
import collections
import threading

import numpy as np
import rospy
from geometry_msgs.msg import Point, Pose

from cuboid_mapping.msg import Box
from cuboid_mapping.srv import SetBoxRequest

# Begins the ids of objects that are boxes of the map.
PREFIX = 'cuboid_'
# Maximum number of voxels of the box around a shape.
_MAX_VOXELS = 1e7


def matrix_of(pose):
    """Returns a geometry_msgs/Pose as a 4 x 4 matrix; a quaternion of zeros means no rotation."""
    turn = np.array([pose.orientation.x, pose.orientation.y, pose.orientation.z, pose.orientation.w])
    matrix = np.eye(4)
    if turn.any():
        x, y, z, w = turn / np.linalg.norm(turn)
        matrix[:3, :3] = [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                          [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                          [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]
    matrix[:3, 3] = pose.position.x, pose.position.y, pose.position.z
    return matrix


class _Shape:
    """A body: half edges of the box around it, and which points are in it."""

    def __init__(self, center, half, contains=None):
        self.center, self.half, self._contains = np.asarray(center, float), np.asarray(half, float), contains

    def contains(self, points, padding):
        points = points - self.center
        is_in = (np.abs(points) <= self.half + padding).all(axis=1)
        return is_in if self._contains is None else is_in & self._contains(points, padding)


def _shape_of_primitive(primitive):
    sizes = list(primitive.dimensions)
    needed = {primitive.BOX: 3, primitive.SPHERE: 1, primitive.CYLINDER: 2, primitive.CONE: 2}.get(primitive.type)
    if needed is None:
        raise ValueError(f'a primitive of type {primitive.type}')
    if len(sizes) < needed:
        raise ValueError(f'a primitive of type {primitive.type} with {len(sizes)} dimensions, not {needed},')
    if primitive.type == primitive.BOX:
        return _Shape((0, 0, 0), np.array(sizes[:3]) / 2)
    if primitive.type == primitive.SPHERE:
        radius = sizes[0]
        return _Shape((0, 0, 0), [radius] * 3, lambda p, pad: np.linalg.norm(p, axis=1) <= radius + pad)
    height, radius = sizes[:2]  # A cone is freed with the cylinder around it.
    return _Shape((0, 0, 0), (radius, radius, height / 2), lambda p, pad: np.linalg.norm(p[:, :2], axis=1) <= radius + pad)


def _shape_of_mesh(mesh):
    corners = np.array([(v.x, v.y, v.z) for v in mesh.vertices])
    if len(corners) == 0:
        raise ValueError('a mesh without vertices')
    return _Shape((corners.min(axis=0) + corners.max(axis=0)) / 2, np.ptp(corners, axis=0) / 2)


def _placed(shapes, poses):
    """Returns poses and shapes in pairs: as for MoveIt, a shape without a pose is where the object is."""
    if len(poses) > len(shapes):
        raise ValueError('an object with more poses than shapes')
    return zip([*poses, *[Pose()] * (len(shapes) - len(poses))], shapes)


def _base_of(collision_object):
    """Returns the pose of an object; messages before Noetic have only poses of its shapes."""
    return matrix_of(getattr(collision_object, 'pose', Pose()))


def shapes_of(collision_object):
    """Returns the shapes of an object with their poses in its frame, as [(matrix, shape)]; meshes as their boxes.

    Raises ValueError for planes, which have no end, unknown primitives, and more poses than shapes.
    """
    if collision_object.planes:
        raise ValueError('a plane')
    base = _base_of(collision_object)
    shapes = [(pose, _shape_of_primitive(primitive))
              for pose, primitive in _placed(collision_object.primitives, collision_object.primitive_poses)]
    shapes += [(pose, _shape_of_mesh(mesh)) for pose, mesh in _placed(collision_object.meshes, collision_object.mesh_poses)]
    return [(base @ matrix_of(pose), shape) for pose, shape in shapes]


def boxes_in(matrix, shape, resolution, padding):
    """Returns boxes (n, 6) of the voxels whose centre lies in a padded shape, as few as columns along z make.

    matrix: pose of the shape in the map. Raises ValueError if it has too many voxels.
    """
    if not (np.isfinite(matrix).all() and np.isfinite(shape.center).all() and np.isfinite(shape.half).all()):
        raise ValueError('a pose or a size that is no number')
    corners = shape.center + (shape.half + padding) * np.array(np.meshgrid(*[(-1, 1)] * 3)).reshape(3, -1).T
    corners = corners @ matrix[:3, :3].T + matrix[:3, 3]
    low = np.floor(corners.min(axis=0) / resolution).astype(int)
    high = np.floor(corners.max(axis=0) / resolution).astype(int) + 1
    if np.prod(high - low, dtype=float) > _MAX_VOXELS:
        raise ValueError('an object of more than %g voxels' % _MAX_VOXELS)
    cells = np.stack(np.meshgrid(*[np.arange(a, b) for a, b in zip(low, high)], indexing='ij'), axis=-1)
    centres = (cells.reshape(-1, 3) + 0.5) * resolution
    inside = shape.contains((centres - matrix[:3, 3]) @ matrix[:3, :3], padding).reshape(cells.shape[:3])
    boxes = []
    edges = np.diff(inside.astype(np.int8), axis=2, prepend=0, append=0)
    for x, y in zip(*np.nonzero(inside.any(axis=2))):
        for begin, end in zip(np.nonzero(edges[x, y] == 1)[0], np.nonzero(edges[x, y] == -1)[0]):
            first = low + (x, y, begin)
            boxes.append([*first, *(first[:2] + 1), low[2] + end])
    return np.array(boxes, float).reshape(-1, 6) * resolution


def box_objects(boxes, frame_id, message_class, primitive_class):
    """Returns collision objects by id, one for each box (n, 6). A box has the same id at all times."""
    objects = {}
    for box in np.asarray(boxes, float):
        added = message_class(operation=message_class.ADD)
        added.header.frame_id = frame_id
        added.id = PREFIX + '_'.join('%d' % round(1000 * value) for value in box)
        primitive = primitive_class(type=primitive_class.BOX, dimensions=list(box[3:] - box[:3]))
        pose = Pose()
        pose.position = Point(*(box[:3] + box[3:]) / 2)
        pose.orientation.w = 1.0
        added.primitives, added.primitive_poses = [primitive], [pose]
        if hasattr(added, 'pose'):
            added.pose.orientation.w = 1.0
        objects[added.id] = added
    return objects


def differences(known, wanted, message_class):
    """Returns the messages that lead from one set of objects to another, both by id: removals first."""
    removals = [message_class(id=name, operation=message_class.REMOVE) for name in known if name not in wanted]
    return removals + [added for name, added in wanted.items() if name not in known]


class MapObjects:
    """Keeps the voxels of MoveIt's objects free and locked in a node's map while they are known.

    So the map is not an obstacle where MoveIt has a better one, and does not come back there. set_box: the service
    ~set_box, or a function like it. transform: frame -> 4 x 4 matrix from it to the map's frame, or an error's text.
    """

    def __init__(self, set_box, transform, resolution, padding):
        self._set_box, self._transform = set_box, transform
        self._resolution, self._padding = resolution, padding
        self._boxes = collections.OrderedDict()  # By the object's id.
        self._shapes = {}  # By the object's id: its pose in the map, and its shapes with theirs.
        self._turn = threading.Lock()

    def take(self, message):
        """Follows a CollisionObject. Returns the reason if it cannot; None if it could."""
        if message.id.startswith(PREFIX):
            return None  # One of the map's own.
        with self._turn:
            if message.operation == message.REMOVE:
                names = [message.id] if message.id else list(self._boxes)
                return next(filter(None, [self._release(name) for name in names]), None)
            return self._hold(message)

    def _hold(self, message):
        to_map = self._transform(message.header.frame_id)
        if isinstance(to_map, str):
            return to_map
        base = to_map @ _base_of(message)
        try:
            if message.operation == message.MOVE and not (message.primitives or message.meshes):
                shapes = self._moved(message, base)
            else:
                shapes = [(to_map @ matrix, shape) for matrix, shape in shapes_of(message)]
            boxes = [boxes_in(matrix, shape, self._resolution, self._padding) for matrix, shape in shapes]
        except ValueError as error:
            return f'{message.id}: {error} is not kept free'
        added = np.concatenate(boxes) if boxes else np.empty((0, 6))
        known = self._boxes.get(message.id)
        if known is not None and message.operation == message.APPEND:
            added = np.unique(np.concatenate([known, added]), axis=0)
            base, shapes = self._shapes[message.id][0], self._shapes[message.id][1] + shapes
        if known is not None and not np.array_equal(known, added):  # A twin stays locked.
            self._release(message.id)
        error = self._call(added, SetBoxRequest.FREE, True)
        if error is None:  # Boxes that are refused once would be refused with those of the others.
            self._boxes[message.id], self._shapes[message.id] = added, (base, shapes)
        return error

    def _moved(self, message, base):
        """Returns the known shapes of an object at their new poses in the map. base: the new pose of the object."""
        if message.id not in self._boxes:
            raise ValueError('an unknown object that is moved')
        old_base, shapes = self._shapes[message.id]
        poses = [*message.primitive_poses, *message.mesh_poses]
        if not poses:
            return [(base @ np.linalg.inv(old_base) @ matrix, shape) for matrix, shape in shapes]
        if len(poses) != len(shapes):
            raise ValueError(f'a move with {len(poses)} poses for {len(shapes)} shapes')
        return [(base @ matrix_of(pose), shape) for pose, (_, shape) in zip(poses, shapes)]

    def _release(self, name):
        boxes = self._boxes.pop(name, None)
        if boxes is None:
            return None
        error = self._call(boxes, SetBoxRequest.KEEP, False)
        others = list(self._boxes.values())  # Objects may share voxels.
        return error or (self._call(np.concatenate(others), SetBoxRequest.FREE, True) if others else None)

    def _call(self, boxes, occupancy, lock):
        if len(boxes) == 0:
            return None
        inset = 0.01 * self._resolution  # set_box takes every voxel that a box touches.
        messages = [Box(Point(*(box[:3] + inset)), Point(*(box[3:] - inset))) for box in boxes]
        try:
            answer = self._set_box(boxes=messages, occupancy=occupancy, lock=lock)
        except rospy.ServiceException as error:
            return f'~set_box: {error}'
        return None if answer.info.success else f'~set_box: {answer.info.message}'


class SceneBoxes:
    """Shows the occupied cuboids of a region of a map to a planning scene, as differences.

    publish: called with each CollisionObject.
    """

    def __init__(self, publish, message_class, primitive_class):
        self._publish, self._message, self._primitive = publish, message_class, primitive_class
        self._known = {}
        self._turn = threading.Lock()

    def update(self, copy, region=None):
        """Publishes what has changed. copy: a cuboid_map.MapCopy; region: a box (6), or None for everything."""
        with self._turn:
            boxes = copy.cuboids(box=region, classes='occupied', joined=True).boxes
            wanted = box_objects(boxes, copy.frame_id, self._message, self._primitive)
            for message in differences(self._known, wanted, self._message):
                self._publish(message)
            self._known = wanted

    def repeat(self, publish):
        """Sends all boxes once more, such as to a new listener."""
        with self._turn:
            for message in self._known.values():
                publish(message)
