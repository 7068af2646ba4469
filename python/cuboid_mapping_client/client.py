# SPDX-License-Identifier: BSD-3-Clause
"""Follows the map of a node."""
import collections
import threading
import time

import rospy

try:
    from cuboid_map import DamagedMessage, MapFollower
except ImportError as error:
    raise ImportError(f'the client needs the Python module cuboid_map ({error}): '
                      'install pybind11-dev and python3-dev, and build cuboid_mapping again') from error
from cuboid_mapping.msg import CuboidMapUpdate, FullCuboidMap
from cuboid_mapping.srv import GetMap


# Seconds to wait for a map that the node sends.
_PATIENCE_S = 3.0
# Maximum number of updates that wait for their map: enough for some seconds.
_MAX_EARLY_UPDATES = 100
# Seconds of silence after which another server may replace the followed one.
_SERVER_PATIENCE_S = 5.0
# Name of the node unless `__name:=` says otherwise.
_DEFAULT_SERVER = 'cuboid_mapping'


def _topic_beside(server, topic):
    """Returns the name of a topic beside a server, unless it is remapped in the namespace of this node."""
    is_remapped = rospy.resolve_name(topic) != rospy.get_namespace() + topic
    return topic if is_remapped else server.rpartition('/')[0] + '/' + topic


def fetch_parts(get_map, first):
    """Returns all parts of a map of one revision, in order. first: part 0. Raises rospy.ServiceException."""
    parts = [first]
    while len(parts) < first.num_parts:
        answer = get_map(with_values=first.bricks.has_values, part=len(parts), revision=first.revision)
        if not answer.info.success:
            raise rospy.ServiceException(answer.info.message)
        parts.append(answer.map)
    return parts


class CuboidMapClient:
    """Keeps a copy of a node's map by its topics cuboid_map and cuboid_map_updates. Thread-safe.

    server: name of the node, in the namespace of this node unless it begins with a slash. The topics are beside it,
        unless they are remapped. Only this node is followed; with the default name also the first that is heard
        there, until it is silent for 5 s. Its service ~get_map is called when updates were lost.
    on_change: called with this client after each change of the map, one call at a time.

    Follows until close(), or to the end of a `with` block.
    """

    def __init__(self, server=_DEFAULT_SERVER, on_change=None):
        # rospy has a thread for each topic; _turn serializes messages.
        self._turn = threading.RLock()
        self._awaited_since = None
        self._early_updates = collections.deque(maxlen=_MAX_EARLY_UPDATES)  # Updates before the awaited map.
        self._has_values = False  # Updates carry log-odds.
        self._is_updated = False  # The last update could be applied, and no map has come since.
        self._map = MapFollower()
        self._on_change = on_change
        self._named_server = rospy.resolve_name(server)
        self._heard_server = '' if server == _DEFAULT_SERVER else self._named_server
        self._heard_at = 0.0
        self._get_map = rospy.ServiceProxy(server + '/get_map', GetMap)
        self._subscribers = [
            rospy.Subscriber(_topic_beside(self._named_server, 'cuboid_map_updates'), CuboidMapUpdate, self._take_update),
            rospy.Subscriber(_topic_beside(self._named_server, 'cuboid_map'), FullCuboidMap, self._take_map)]

    def close(self):
        """Stops following; the map stays as it is once a running update is done, and on_change is not called any more."""
        for subscriber in self._subscribers:
            subscriber.unregister()
        with self._turn:
            self._on_change = None

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def wait_for_map(self, timeout=None):
        """Blocks until has_map; logs the reason if that takes some seconds.

        timeout: seconds; None: no limit.
        Returns False after the timeout, or when this node is shut down.
        """
        begin = told = time.monotonic()
        while not rospy.is_shutdown():
            now = time.monotonic()
            left = float('inf') if timeout is None else begin + timeout - now
            if self.has_map:
                return True
            time.sleep(max(0.0, min(left, 0.1)))
            if left <= 0.0 or now - told > _PATIENCE_S:
                told = now
                self._say_what_is_missing()
            if left <= 0.0:
                break
        return self.has_map

    @property
    def map(self):
        """The map, a cuboid_map.MapFollower with all queries: cuboids(), cast_rays() ...

        Queries before the first map raise RuntimeError: see wait_for_map().
        """
        return self._map

    def copy(self):
        """Returns the current revision as a cuboid_map.MapCopy, which does not change, for several queries.

        It has all queries, `revision`, `instance`, `replacements`, `stamp_ns` and `frame_id`. It costs no time, and holds
        up no update.
        """
        return self._map.copy()

    @property
    def has_map(self):
        """Whether a map has come that knows a voxel.

        False again while a restarted or reset node's map is empty: no answer about it helps a planner.
        """
        return self._map.has_map

    @property
    def revision(self):
        """Revision of the server's map that the copy equals; 0 before the first map."""
        return self._map.revision

    @property
    def instance(self):
        """Number of the server's run, which changes when it restarts; 0 before the first map."""
        return self._map.instance

    @property
    def replacements(self):
        """Times that a reset, load, move or correction has replaced the server's map in this run."""
        return self._map.replacements

    @property
    def stamp(self):
        """Stamp of the last cloud in the map, a rospy.Time; 0 before the first."""
        return rospy.Time(0, self._map.stamp_ns)

    @property
    def frame_id(self):
        """Frame of the map; '' before the first map."""
        return self._map.frame_id

    def _say_what_is_missing(self):
        topic, service = self._subscribers[1].resolved_name, self._get_map.resolved_name
        try:
            rospy.wait_for_service(service, 0.01)
            rospy.logwarn('no map has come on %s yet, although %s is served', topic, service)
        except rospy.ROSException:
            rospy.logwarn('no map has come on %s yet, and nobody serves %s: is the name of the server right, '
                          'and does it run?', topic, service)

    def _take_map(self, message):
        """message: a FullCuboidMap, or a part of one."""
        with self._turn:
            if self._is_of_other_server(message.server):
                return
            if message.part > 0:  # Belongs to a keyframe; the service has all parts.
                return
            is_updated, self._is_updated = self._is_updated, False
            if is_updated and message.instance == self._map.instance:
                return  # A keyframe brings nothing new while updates arrive.
            self._awaited_since = None
            if message.instance == self._map.instance and message.revision <= self._map.revision:
                return
            try:
                parts = fetch_parts(self._get_map, message)
            except rospy.ServiceException as error:
                rospy.logwarn_throttle(10.0, 'cannot follow the map: %s' % error)
                self._awaited_since = time.monotonic()  # The next update requests it.
                return
            try:
                self._map.take_map(parts)
            except DamagedMessage as error:
                rospy.logwarn_throttle(10.0, 'ignored a damaged FullCuboidMap: %s' % error)
                return
            self._tell()
            early = list(self._early_updates)
            self._early_updates.clear()
            for update in early:
                if update.instance == message.instance:
                    self._take_update(update)

    def _take_update(self, message):
        with self._turn:
            if self._is_of_other_server(message.server):
                return
            before = self._map.revision
            self._has_values = message.bricks.has_values
            is_good = self._map.take_update(message)
            if self._map.revision != before:
                self._tell()
            self._is_updated = is_good
            if is_good:
                return
            if not self._is_map_on_its_way(message):
                self._ask_for_map()
            else:
                # Updates may overtake the map. The oldest may be dropped: the map then shows a gap.
                self._early_updates.append(message)

    def _is_of_other_server(self, name):
        """Whether a node's message is ignored: the client follows the named node, or, if it has the default name, the
        first that it hears."""
        now = time.monotonic()
        is_kept = self._heard_server == self._named_server or now - self._heard_at < _SERVER_PATIENCE_S
        if self._heard_server and name not in (self._heard_server, self._named_server) and is_kept:
            rospy.logwarn_throttle(10.0, 'ignored the map of %s on %s: %s is followed; start each node in a namespace of '
                                   'its own, or give the other name as `server`' %
                                   (name, self._subscribers[1].resolved_name, self._heard_server))
            return True
        if name != (self._heard_server or self._named_server):
            self._get_map = rospy.ServiceProxy(name + '/get_map', GetMap)
        self._heard_server = name
        self._heard_at = now
        return False

    def _is_map_on_its_way(self, message):
        """Whether the node will send its map without a request, as to each new connection, also after a restart: a
        request would fetch it twice."""
        if message.instance == self._map.instance:
            return False
        now = time.monotonic()
        if self._awaited_since is None:
            self._awaited_since = now
        return now - self._awaited_since < _PATIENCE_S

    def _ask_for_map(self):
        try:
            answer = self._get_map(with_values=self._has_values)
        except rospy.ServiceException as error:
            rospy.logwarn_throttle(10.0, 'cannot follow the map: %s' % error)
            return
        if answer.info.success:
            self._take_map(answer.map)

    def _tell(self):
        if self._on_change is not None:
            self._on_change(self)
