# SPDX-License-Identifier: BSD-3-Clause
"""A listener to the topics of octomap_server that notes when messages come, and does not read their maps."""

import math
import struct
import time

import rospy

# Topics, and the bytes before the header of their messages or of the first marker.
MAP_TOPICS = {'occupied_cells_vis_array': 4, 'octomap_binary': 0, 'projected_map': 0}
TF_OFFSET = 4


def read_stamp_ns(content, offset):
    """@return The stamp of the header at an offset [ns], or None if the message is too short."""
    if len(content) < offset + 12:
        return None
    seconds, nanoseconds = struct.unpack_from('<II', content, offset + 4)
    return seconds * 10**9 + nanoseconds


class MapListener:
    """Knows the octomap_msgs by their bytes, so that the package is not needed.

    The player sends a transform with the stamp of a cloud just before that cloud. Its arrival here is
    the time of the cloud: a second listener to clouds would cost the player CPU time.
    """

    def __init__(self, topics):
        """@param topics  Some of MAP_TOPICS. If there are none, it does not listen at all."""
        self.sent_s = {}  # By stamp; seconds of the monotonic clock.
        self.arrived_s = {topic: [] for topic in topics}  # (stamp, time).
        self.subscribers = [self.subscribe('/' + topic, MAP_TOPICS[topic], self.arrived_s[topic].append)
                            for topic in topics]
        if topics:
            self.subscribers.append(
                self.subscribe('/tf', TF_OFFSET, lambda arrival: self.sent_s.setdefault(*arrival)))

    @staticmethod
    def subscribe(topic, offset, note):
        def on_message(message):
            stamp_ns = read_stamp_ns(message._buff, offset)  # rospy offers no other way to the bytes.
            if stamp_ns is not None:
                note((stamp_ns, time.monotonic()))
        return rospy.Subscriber(topic, rospy.AnyMsg, on_message, queue_size=1000, tcp_nodelay=True)

    def stop(self):
        for subscriber in self.subscribers:
            subscriber.unregister()

    def find_delays_s(self, stamps_ns):
        """Time from each cloud until all topics have sent a map of its stamp or later; infinite where none came."""
        return [max(self.find_arrival_s(arrivals, stamp) for arrivals in self.arrived_s.values())
                - self.sent_s[stamp] for stamp in stamps_ns if stamp in self.sent_s]

    @staticmethod
    def find_arrival_s(arrivals, stamp_ns):
        return min((arrived_s for stamp, arrived_s in arrivals if stamp >= stamp_ns), default=math.inf)
