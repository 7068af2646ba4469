# SPDX-License-Identifier: BSD-3-Clause
"""Programs that a campaign starts, and waits for."""

import os
import subprocess
import sys
import time
import xmlrpc.client


class Processes:
    """Programs that end when this one ends."""

    def __init__(self):
        self.all = []

    def start(self, *command, stdout=subprocess.DEVNULL):
        process = subprocess.Popen(command, stdout=stdout, stderr=subprocess.DEVNULL)
        self.all.append(process)
        return process

    def stop(self):
        for process in reversed(self.all):
            process.terminate()
        for process in self.all:
            try:
                process.wait(10)
            except subprocess.TimeoutExpired:
                process.kill()


def cpu_s(pid):
    with open(f'/proc/{pid}/stat', encoding='ascii') as stat:
        user, system = stat.read().rsplit(')', 1)[1].split()[11:13]
    return (int(user) + int(system)) / os.sysconf('SC_CLK_TCK')


def find_program(name, package='cuboid_mapping'):
    folders = os.environ.get('CMAKE_PREFIX_PATH', '').split(':')
    for folder in folders:
        program = os.path.join(folder, 'lib', package, name)
        if os.path.exists(program):
            return program
    sys.exit(f'{name} is not built, or its setup.bash is not sourced')


def wait_for(what, condition, limit_s=180.0):
    start = time.time()
    while time.time() - start < limit_s:
        try:
            if condition():
                return
        except (OSError, xmlrpc.client.Error):
            pass
        time.sleep(0.05)
    sys.exit(f'{what} has not come within {limit_s} s')
