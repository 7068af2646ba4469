# SPDX-License-Identifier: BSD-3-Clause
"""What a node says of its clouds."""

import sys
import time

import rospy
from diagnostic_msgs.msg import DiagnosticArray


class CloudCounts:
    """The counts of a node in /diagnostics."""

    NAMES = ('clouds received', 'clouds inserted', 'clouds dropped')

    def __init__(self, node):
        self.name = node.strip('/')
        self.counts = None
        rospy.Subscriber('/diagnostics', DiagnosticArray, self.note)

    def note(self, message):
        for status in message.status:
            values = {value.key: value.value for value in status.values}
            if self.name in status.name and self.NAMES[0] in values:
                self.counts = [int(values[name].split()[0]) for name in self.NAMES]

    def next(self):
        """The counts of a message that is yet to come."""
        self.counts = None
        limit = time.time() + 20.0
        while self.counts is None:
            if time.time() > limit:
                sys.exit('the node has sent no diagnostics for 20 s')
            time.sleep(0.05)
        return self.counts
