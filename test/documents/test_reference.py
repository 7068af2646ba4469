#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Pages of the reference say what their sources say, and leave nothing out."""
import importlib.machinery
import importlib.util
import pathlib
import re
import subprocess
import sys
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROGRAMS = pathlib.Path(sys.argv.pop()) if __name__ == '__main__' and len(sys.argv) > 1 else ROOT / 'devel/lib/cuboid_mapping'
loader = importlib.machinery.SourceFileLoader('reference', str(ROOT / 'scripts/reference'))
reference = importlib.util.module_from_spec(importlib.util.spec_from_loader('reference', loader))
loader.exec_module(reference)


def names_of(kind):
    return re.findall(rf'{kind}\[\] = "(\w+)"', reference.NAMES.read_text())


class ReferenceTest(unittest.TestCase):

    def test_its_pages_are_what_their_sources_say(self):
        checked = subprocess.run([ROOT / 'scripts/reference', '--check', '--programs', PROGRAMS], capture_output=True, text=True)
        self.assertEqual(checked.returncode, 0, checked.stderr)

    def test_each_service_has_a_row_and_each_file_a_section(self):
        page = (ROOT / 'doc/services.md').read_text()
        for name in names_of('Service'):
            if name != 'set_parameters':  # Of dynamic_reconfigure.
                self.assertIn(f'\n| `~{name}` |', page)
        for file in [*(ROOT / 'srv').iterdir(), *(ROOT / 'msg').iterdir()]:
            self.assertIn(f'\n## {file.stem}\n', page)

    def test_each_topic_has_a_row(self):
        page = (ROOT / 'doc/interface.md').read_text()
        rows = '\n'.join(line for line in page.splitlines() if line.startswith('|'))
        for name in names_of('Topic'):
            if not name.startswith('parameter_'):
                self.assertIn(f'`{name}`', rows)

    def test_each_program_that_is_installed_has_a_section(self):
        cmake = (ROOT / 'src/programs.cmake').read_text()
        calls = re.findall(r'(?:cuboid_mapping_install_(?:programs|extras)\(|install\(TARGETS)([^)]*)', cmake)
        named = re.findall(r'\b[a-z_]+\b', ' '.join(call.split('RUNTIME')[0] for call in calls))
        named += re.findall(r'(?:python|examples)/(?:\w+/)?([\w.]+)', re.search(
            r'catkin_install_python\(PROGRAMS([^)]*)', (ROOT / 'cmake/ros_package.cmake').read_text())[1])
        named.remove('check_arguments')  # Launch files call it.
        listed = [name for names in reference.PROGRAMS.values() for name in names]
        self.assertGreater(len(named), 8)
        for program in named:
            self.assertIn(program, listed)


if __name__ == '__main__':
    unittest.main()
