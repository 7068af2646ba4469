#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The running node, and the Python client that follows its map."""
import threading
import time
import unittest
from unittest import mock

import genpy
import rospy
import rostest
from cuboid_map import MapFollower
from geometry_msgs.msg import Point
from std_srvs.srv import Empty

from cuboid_mapping.msg import Box, CuboidMapUpdate
from cuboid_mapping.srv import GetCuboids, GetCuboidsRequest, GetMap, SetBox, SetBoxRequest
from cuboid_mapping_client import CuboidMapClient, client as client_module
from waiting import wait_for

NODE = '/cuboid_mapping'


class BoxRequest(genpy.Message):
    """octomap_msgs/BoundingBoxQuery, which Debian does not have."""
    _type = 'octomap_msgs/BoundingBoxQueryRequest'
    _md5sum = '93aa3d73b866f04880927745f4aab303'
    __slots__ = ['min', 'max']
    _slot_types = ['geometry_msgs/Point', 'geometry_msgs/Point']

    def serialize(self, buff):
        self.min.serialize(buff)
        self.max.serialize(buff)


class BoxResponse(genpy.Message):
    _type = 'octomap_msgs/BoundingBoxQueryResponse'
    _md5sum = BoxRequest._md5sum
    __slots__ = []
    _slot_types = []

    def deserialize(self, _):
        return self


class ClearBox:
    _type = 'octomap_msgs/BoundingBoxQuery'
    _md5sum = BoxRequest._md5sum
    _request_class = BoxRequest
    _response_class = BoxResponse


class PythonClientTest(unittest.TestCase):

    def setUp(self):
        rospy.wait_for_service(NODE + '/set_box', 60.0)
        self.set_box_service = rospy.ServiceProxy(NODE + '/set_box', SetBox)

    def set_box(self, low, high, occupancy):
        answer = self.set_box_service(
            boxes=[Box(Point(*low), Point(*high))], occupancy=occupancy)
        self.assertTrue(answer.info.success, answer.info.message)
        return answer.info.revision

    def expect_same_map(self, client):
        answer = rospy.ServiceProxy(NODE + '/get_cuboids', GetCuboids)(
            everything=True, classes=GetCuboidsRequest.ALL)
        self.assertTrue(wait_for(lambda: client.revision >= answer.info.revision))
        self.assertEqual(client.revision, answer.info.revision)
        self.assertEqual((client.instance, client.replacements), (answer.info.instance, answer.info.replacements))
        boxes = [(cuboid.min.x, cuboid.min.y, cuboid.min.z, cuboid.max.x, cuboid.max.y, cuboid.max.z)
                 for cuboid in answer.cuboids]
        copy = client.copy()
        found, cuboids = copy.query_boxes(boxes), copy.cuboids()
        self.assertEqual(found.occupancy.tolist(), [cuboid.occupancy for cuboid in answer.cuboids])
        self.assertAlmostEqual(found.unknown_volume.sum(), 0.0)
        sizes = cuboids.boxes[:, 3:] - cuboids.boxes[:, :3]
        self.assertAlmostEqual(sizes.prod(axis=1).sum(), found.free_volume.sum() + found.occupied_volume.sum())

    def test_a_service_that_throws_tells_why(self):
        clear = rospy.ServiceProxy(NODE + '/clear_bbx', ClearBox)
        with self.assertRaisesRegex(rospy.ServiceException, 'corners must be finite'):
            clear(BoxRequest(Point(1, 0, 0), Point(0, 0, 0)))
        clear(BoxRequest(Point(0, 0, 0), Point(1, 0, 0)))

    def test_follows_edits_from_the_beginning_and_late(self):
        changes = []
        client = CuboidMapClient(NODE, on_change=changes.append)
        self.addCleanup(client.close)
        self.assertTrue(wait_for(lambda: client.instance != 0))
        self.set_box((-5, -5, -5), (5, 5, 5), SetBoxRequest.FREE)
        self.set_box((-1, -1, -1), (1, 1, 30), SetBoxRequest.OCCUPIED)
        self.expect_same_map(client)
        late = CuboidMapClient(NODE)
        self.addCleanup(late.close)
        self.set_box((0, 0, 0), (2, 2, 2), SetBoxRequest.UNKNOWN)
        for each in (client, late):
            self.assertTrue(each.wait_for_map(60.0))
            self.expect_same_map(each)
            self.assertEqual(each.frame_id, 'map')
            self.assertAlmostEqual(each.map.resolution, 0.1)
            found = each.map.query_boxes([(0, 0, 0, 1, 1, 2.5)])
            self.assertAlmostEqual(found.occupied_volume[0], 0.5)
            self.assertAlmostEqual(found.unknown_volume[0], 2.0)
        self.assertGreaterEqual(len(changes), 2)

    def test_a_copy_stays_as_it_is_while_the_client_goes_on(self):
        with CuboidMapClient(NODE) as client:
            self.set_box((-5, -5, -5), (5, 5, 5), SetBoxRequest.FREE)
            self.expect_same_map(client)
            copies = []
            for i in range(6):
                copies.append(client.copy())
                revision = self.set_box((0, 0, 0), (1, 1, 1 + i), SetBoxRequest.OCCUPIED)
                self.assertTrue(wait_for(lambda: client.revision >= revision), 'a held copy holds up nothing')
            copies.append(client.copy())
            volumes = [copy.query_boxes([(0, 0, 0, 1, 1, 6)]).occupied_volume[0] for copy in copies]
            for volume, wanted in zip(volumes, range(7)):
                self.assertAlmostEqual(volume, wanted)
            self.assertEqual(copies[-1].revision, client.revision)
            self.assertLess(copies[-2].revision, client.revision)
            self.assertEqual(copies[-1].frame_id, 'map')
            self.assertEqual(copies[-1].stamp_ns, client.stamp.to_nsec())

    def test_a_reset_is_a_replacement_and_an_empty_map_is_none(self):
        with CuboidMapClient(NODE) as client:
            self.set_box((0, 0, 0), (1, 1, 1), SetBoxRequest.OCCUPIED)
            self.assertTrue(wait_for(lambda: client.has_map))
            before = client.replacements
            rospy.ServiceProxy(NODE + '/reset', Empty)()
            self.assertTrue(wait_for(lambda: client.replacements == before + 1))
            self.assertFalse(client.has_map)
            self.assertFalse(client.wait_for_map(0.1))

    def test_fetches_the_map_once(self):
        with mock.patch.object(client_module, '_PATIENCE_S', 60.0):
            for i in range(5):
                with CuboidMapClient(NODE) as client:
                    client._get_map = mock.Mock(side_effect=rospy.ServiceException('not wanted'))
                    # It gets the updates from now on; the map may be on its way.
                    self.assertTrue(wait_for(lambda each=client: each._subscribers[0].get_num_connections() > 0))
                    self.set_box((i, 0, 0), (i + 1, 1, 1), SetBoxRequest.FREE)
                    self.assertTrue(wait_for(lambda each=client: each.has_map))
                    self.expect_same_map(client)
                    client._get_map.assert_not_called()

    def test_misses_no_update_that_overtakes_the_map(self):
        updates = []
        listener = rospy.Subscriber('cuboid_map_updates', CuboidMapUpdate, updates.append)
        self.addCleanup(listener.unregister)
        self.assertTrue(wait_for(lambda: listener.get_num_connections() > 0))
        before = rospy.ServiceProxy(NODE + '/get_map', GetMap)().map
        client = CuboidMapClient(NODE)
        client.close()
        client._map = MapFollower()
        revision = self.set_box((0, 0, 0), (1, 1, 1 + 0.1 * (before.revision % 2)), SetBoxRequest.OCCUPIED)
        self.assertTrue(wait_for(lambda: updates and updates[-1].revision >= revision))
        for update in updates:
            client._take_update(update)
        self.assertFalse(client.has_map)
        client._take_map(before)
        self.expect_same_map(client)

    def test_calls_back_from_one_place_at_a_time_and_not_after_close(self):
        inside = threading.Semaphore(1)
        overlaps = []
        revisions = []

        def on_change(client):
            if not inside.acquire(blocking=False):
                overlaps.append(client.revision)
                return
            revisions.append(client.revision)
            time.sleep(0.05)
            inside.release()

        with CuboidMapClient(NODE, on_change=on_change) as client:
            for i in range(10):
                revision = self.set_box((i, 0, 0), (i + 1, 1, 1), SetBoxRequest.OCCUPIED)
            self.assertTrue(wait_for(lambda: client.revision >= revision))
        self.assertEqual(overlaps, [])
        self.assertEqual(revisions, sorted(revisions))
        num_calls = len(revisions)
        with CuboidMapClient(NODE) as other:
            revision = self.set_box((0, 5, 0), (1, 6, 1), SetBoxRequest.OCCUPIED)
            self.assertTrue(wait_for(lambda: other.revision >= revision))
        self.assertEqual(len(revisions), num_calls)
        self.assertLess(client.revision, revision)

    def test_asks_for_the_map_when_updates_were_lost_or_the_node_was_started_anew(self):
        client = CuboidMapClient(NODE)
        self.addCleanup(client.close)
        self.assertTrue(wait_for(lambda: client.instance != 0))
        self.set_box((-5, -5, -5), (5, 5, 5), SetBoxRequest.FREE)
        self.expect_same_map(client)
        answer = rospy.ServiceProxy(NODE + '/get_map', GetMap)()
        old = answer.map
        for field in ('header', 'revision', 'instance', 'replacements'):
            self.assertEqual(getattr(answer.info, field), getattr(old, field), field)
        self.set_box((-5, -5, -5), (0, 5, 5), SetBoxRequest.OCCUPIED)
        self.expect_same_map(client)
        for instance, base in ((old.instance, client.revision + 5), (old.instance - 1, 0)):
            client._map = MapFollower()  # Like a client that has missed the last updates.
            client._map.take_map(old)
            lost = CuboidMapUpdate(server=NODE, instance=instance, base=base, revision=base + 1, resolution=0.1)
            with mock.patch.object(client_module, '_PATIENCE_S', 0.0):
                client._take_update(lost)
            self.expect_same_map(client)


if __name__ == '__main__':
    rospy.init_node('test_python_client')
    rostest.rosrun('cuboid_mapping', 'python_client', PythonClientTest)
