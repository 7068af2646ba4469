# SPDX-License-Identifier: BSD-3-Clause
"""Follows the map of a node."""
import threading
import time

import rospy

from cuboid_mapping.msg import CuboidMapUpdate, FullCuboidMap
from cuboid_mapping.srv import GetMap
from cuboid_mapping_client.map_copy import DamagedMessage, MapCopy


# Seconds for which a map that comes by itself is waited for.
_PATIENCE_S = 3.0


class CuboidMapClient:
    """Follows cuboid_map and cuboid_map_updates into a MapCopy. Thread-safe.

    server: name of the node, for ~get_map, which is asked when updates were lost. In the namespace of
        this node unless it begins with a slash.
    on_change: called with this client after each change of the map, one call after the other.

    Follows until close(), or to the end of a `with` block.
    """

    def __init__(self, server='cuboid_mapping', on_change=None):
        self._lock = threading.RLock()
        # rospy has a thread for each topic; messages are worked on one after the other.
        self._turn = threading.RLock()
        self._awaited_since = None
        self._has_values = False  # Log-odds travel with the updates.
        self._copy = MapCopy()
        self._frame_id = ''
        self._on_change = on_change
        self._get_map = rospy.ServiceProxy(server + '/get_map', GetMap)
        self._subscribers = [
            rospy.Subscriber('cuboid_map_updates', CuboidMapUpdate, self._take_update),
            rospy.Subscriber('cuboid_map', FullCuboidMap, self._take_map)]

    def close(self):
        """Stops following; the map stays as it is. on_change is not called any more."""
        for subscriber in self._subscribers:
            subscriber.unregister()
        with self._turn:
            self._on_change = None

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

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

    def log_odds_at(self, voxel):
        """Log-odds of a voxel, see MapCopy.log_odds_at: only where the node has publish_values."""
        with self._lock:
            return self._copy.log_odds_at(voxel)

    def count(self, low_m, high_m):
        """Free, occupied and unknown voxels of a box in metres."""
        with self._lock:
            return self._copy.count(low_m, high_m)

    def _take_map(self, message):
        with self._turn:
            self._awaited_since = None
            with self._lock:
                if (message.instance == self._copy.instance
                        and message.revision <= self._copy.revision):
                    return
                try:
                    self._copy.take_map(message)
                except DamagedMessage as error:
                    rospy.logwarn_throttle(10.0, 'a damaged FullCuboidMap was left out: %s' % error)
                    return
                self._frame_id = message.header.frame_id
            self._tell()

    def _take_update(self, message):
        with self._turn:
            with self._lock:
                before = self._copy.revision
                self._has_values = message.bricks.has_values
                is_good = self._copy.take_update(message)
                is_changed = self._copy.revision != before
            if is_changed:
                self._tell()
            if not is_good and not self._is_map_on_its_way(message):
                self._ask_for_map()

    def _is_map_on_its_way(self, message):
        """The node sends its map to each listener that connects, also when it was started anew: to ask
        for it as well would fetch it twice."""
        if message.instance == self._copy.instance:
            return False
        now = time.monotonic()
        if self._awaited_since is None:
            self._awaited_since = now
        return now - self._awaited_since < _PATIENCE_S

    def _ask_for_map(self):
        try:
            answer = self._get_map(with_values=self._has_values)
        except rospy.ServiceException as error:
            rospy.logwarn_throttle(10.0, 'the map cannot be followed: %s' % error)
            return
        if answer.success:
            self._take_map(answer.map)

    def _tell(self):
        if self._on_change is not None:
            self._on_change(self)
