# SPDX-License-Identifier: BSD-3-Clause
"""Follows the map of a node."""
import threading

import rospy

from cuboid_mapping.msg import CuboidMap, CuboidMapUpdate
from cuboid_mapping.srv import GetMap
from cuboid_mapping_client.map_copy import MapCopy


class CuboidMapClient:
    """Follows cuboid_map and cuboid_map_updates into a MapCopy. Thread-safe.

    server: name of the node, for ~get_map, which is asked when updates were lost. In the namespace of
        this node unless it begins with a slash.
    on_change: called with this client after each change of the map.
    """

    def __init__(self, server='cuboid_mapping', on_change=None):
        self._lock = threading.RLock()
        self._copy = MapCopy()
        self._frame_id = ''
        self._on_change = on_change
        self._get_map = rospy.ServiceProxy(server + '/get_map', GetMap)
        rospy.Subscriber('cuboid_map_updates', CuboidMapUpdate, self._take_update)
        rospy.Subscriber('cuboid_map', CuboidMap, self._take_map)

    @property
    def has_map(self):
        with self._lock:
            return self._copy.instance is not None

    @property
    def revision(self):
        """Of the server's map that this one equals; 0 before the first."""
        with self._lock:
            return self._copy.revision

    @property
    def frame_id(self):
        with self._lock:
            return self._frame_id

    @property
    def resolution(self):
        """Edge of a voxel in metres; None before the first map."""
        with self._lock:
            return self._copy.resolution

    def cuboids(self, low=None, high=None):
        """All cuboids, or those in a box of voxels: see MapCopy.cuboids."""
        with self._lock:
            return self._copy.cuboids(low, high)

    def count(self, low_m, high_m):
        """Free, occupied and unknown voxels of a box in metres."""
        with self._lock:
            return self._copy.count(low_m, high_m)

    def _take_map(self, message):
        with self._lock:
            self._copy.take_map(message)
            self._frame_id = message.header.frame_id
        self._tell()

    def _take_update(self, message):
        with self._lock:
            before = self._copy.revision
            is_good = self._copy.take_update(message)
            is_changed = self._copy.revision != before
        if not is_good:
            try:
                answer = self._get_map()
            except rospy.ServiceException as error:
                rospy.logwarn_throttle(10.0, 'the map cannot be followed: %s' % error)
                return
            if answer.success:
                self._take_map(answer.map)
        elif is_changed:
            self._tell()

    def _tell(self):
        if self._on_change is not None:
            self._on_change(self)
