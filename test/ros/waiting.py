# SPDX-License-Identifier: BSD-3-Clause
"""What tests with a running node have in common."""
import time


def wait_for(condition, timeout_s=60.0):
    """Whether a condition comes true in time."""
    deadline = time.monotonic() + timeout_s
    while time.monotonic() < deadline:
        if condition():
            return True
        time.sleep(0.02)
    return False
