#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""README and doc/: short enough, and no link leads nowhere."""
import pathlib
import re
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
PAGES = [ROOT / 'README.md', ROOT / 'CONTRIBUTING.md', *sorted((ROOT / 'doc').glob('*.md'))]


class DocumentsTest(unittest.TestCase):

    def test_the_readme_is_short_and_begins_with_the_two_commands(self):
        lines = (ROOT / 'README.md').read_text().splitlines()
        self.assertLessEqual(len(lines), 120)
        screen = '\n'.join(lines[:15])
        for part in ('scripts/demo', 'scripts/test', 'doc/demo.gif'):
            self.assertIn(part, screen)

    def test_the_moving_picture_moves_and_is_small(self):
        content = (ROOT / 'doc/demo.gif').read_bytes()
        self.assertEqual(content[:6], b'GIF89a')
        self.assertGreater(content.count(b'\x21\xf9\x04'), 5, 'frames')
        self.assertLess(len(content), 1.5e6)

    def test_links_lead_to_files(self):
        num_links = 0
        for page in PAGES:
            text = re.sub(r'```.*?```', '', page.read_text(), flags=re.DOTALL)
            for link in re.findall(r'\]\(([^)#]+)\)', text):
                if link.startswith('http'):
                    continue
                num_links += 1
                self.assertTrue((page.parent / link).exists(), f'{page.name}: {link}')
        self.assertGreater(num_links, 20)


if __name__ == '__main__':
    unittest.main()
