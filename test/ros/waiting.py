# SPDX-License-Identifier: BSD-3-Clause
"""Common parts of tests with a running node."""
import functools
import subprocess
import time


@functools.lru_cache(maxsize=None)
def program(name):
    """The file of a program; rosrun looks for it anew each time, which takes longer than most programs."""
    command = ['catkin_find', '--first-only', '--libexec', 'cuboid_mapping', name]
    return subprocess.check_output(command, universal_newlines=True).strip()


def wait_for(condition, timeout_s=60.0):
    """Waits for a condition. Returns whether it has come true in time."""
    deadline = time.monotonic() + timeout_s
    while time.monotonic() < deadline:
        if condition():
            return True
        time.sleep(0.02)
    return False
