# SPDX-License-Identifier: BSD-3-Clause
"""Common parts of tests with a running node."""
import time


def wait_for(condition, timeout_s=60.0):
    """Waits for a condition. Returns whether it has come true in time."""
    deadline = time.monotonic() + timeout_s
    while time.monotonic() < deadline:
        if condition():
            return True
        time.sleep(0.02)
    return False
