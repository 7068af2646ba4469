#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""README and guides are easy to read; pages have no broken links, and their commands work."""
import pathlib
import os
import re
import shlex
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
PAGES = [ROOT / 'README.md', ROOT / 'CONTRIBUTING.md', *sorted((ROOT / 'doc').rglob('*.md'))]
# Programs in documents are parts of files that other tests build and run.
PROGRAMS = [path.read_text() for path in sorted((ROOT / 'examples').rglob('*')) if path.is_file()]
# Pages for users, beside README.
GUIDES = ('clean_maps', 'compare', 'display', 'faq', 'first_map', 'fleet', 'install', 'interface', 'library', 'method', 'octomap_server', 'plan',
          'planner_guide', 'poses', 'python', 'sensors', 'troubleshooting', 'tutorial', 'window')
# First words of command lines that do not belong to this package.
OTHERS = {'.', 'catkin_make', 'cd', 'cmake', 'ctest', 'export', 'pip', 'python3', 'rosdep', 'rostopic', 'sudo', 'wget'}


def read_blocks(page):
    """(language, text) of each block of a page; blocks without a language are shell lines."""
    text = page.read_text()
    blocks = [(language or 'sh', block) for language, block in re.findall(r'```(\w*)\n(.*?)```', text, re.DOTALL)]
    text = re.sub(r'```.*?```', '', text, flags=re.DOTALL)
    for block in re.findall(r'(?:^|\n)\n((?:    .*\n?)+)', text):
        blocks.append(('sh', '\n'.join(line[4:] for line in block.split('\n'))))
    return blocks


def read_prose(text):
    """A page without tables, code, pictures and marks of generated parts."""
    text = re.sub(r'^```.*?^```', '', text, flags=re.MULTILINE | re.DOTALL)
    return '\n'.join(line for line in text.splitlines() if not line.startswith(('|', '    ', '<!--', '![')))


def read_commands(block):
    """The words of each command of a block; in a session, only lines with a $."""
    lines = block.replace('\\\n', ' ').replace('$(rospack find cuboid_mapping)', '.').split('\n')
    if any(line.startswith('$ ') for line in lines):
        lines = [line[2:] for line in lines if line.startswith('$ ')]
    for line in lines:
        words = shlex.split(line, comments=True)
        while words and re.match(r'[A-Z_]+=', words[0]):
            words.pop(0)
        if words:
            yield words


class DocumentsTest(unittest.TestCase):

    def test_the_readme_is_short_and_begins_with_a_picture_and_the_two_commands(self):
        text = (ROOT / 'README.md').read_text()
        self.assertLessEqual(len(text.split()), 800)
        screen = '\n'.join(text.splitlines()[:30])
        for part in ('doc/cuboids.png', 'scripts/demo', 'scripts/test'):
            self.assertIn(part, screen)

    def test_readers_of_guides_meet_few_numbers(self):
        for page, limit in {'README.md': 4, **{f'doc/{name}.md': 6 for name in GUIDES}}.items():
            text = re.sub(r'\]\([^)]*\)', ']', read_prose((ROOT / page).read_text()))
            text = re.sub(r'`[^`]*`', 'name', text)
            words = text.split()
            numbers = [word for word in words if re.search(r'\d', word)]
            with self.subTest(page=page):
                self.assertLessEqual(100 * len(numbers), limit * len(words), numbers)
            for sentence in re.split(r'(?<=[.:;?!])\**\s|\n\n|\n- ', text):
                with self.subTest(page=page, sentence=sentence):
                    self.assertLessEqual(len(re.findall(r'(?<![\w.])\d[\d.,]*', sentence)), 2)

    def test_guides_leave_evidence_to_its_pages(self):
        """No commit, no name of a campaign, no remark on the machine; cells of tables are short."""
        for page in ('README.md', *(f'doc/{name}.md' for name in GUIDES)):
            text = (ROOT / page).read_text()
            with self.subTest(page=page):
                self.assertNotRegex(text, r'\bbusy\b|[Mm]edians? of|campaign/|kept/|(?<![\w.])(?=[a-f]*[0-9])[0-9a-f]{7,12}\b')
            for line in text.splitlines():
                if line.startswith('|'):
                    for cell in re.sub(r'\]\([^)]*\)', ']', line).split('|'):
                        with self.subTest(page=page, cell=cell):
                            self.assertLessEqual(len(cell.split()), 25)

    def test_the_appendix_is_short(self):
        words = sum(len(page.read_text().split()) for page in (ROOT / 'doc/tables').iterdir())
        self.assertLessEqual(words, 9000)

    def test_the_moving_pictures_move_and_are_small(self):
        for name in ('explore.gif', 'growing.gif'):
            content = (ROOT / 'doc' / name).read_bytes()
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

    def test_links_lead_to_headings(self):
        num_links = 0
        for page in PAGES:
            text = re.sub(r'```.*?```', '', page.read_text(), flags=re.DOTALL)
            for file, anchor in re.findall(r'\]\(([^)#:]*)#([^)]+)\)', text):
                num_links += 1
                target = page.parent / file if file else page
                headings = re.findall(r'^#+ (.*)', target.read_text(), re.MULTILINE)
                with self.subTest(page=page.name, link=f'{file}#{anchor}'):
                    self.assertIn(anchor, [re.sub(r'[^\w -]', '', heading.lower()).replace(' ', '-') for heading in headings])
        self.assertGreater(num_links, 20)

    def test_folders_use_those_above_them_only(self):
        folders = re.findall(r'^\| `([a-z_/]+)/` \|', (ROOT / 'doc/design.md').read_text(), re.MULTILINE)
        num_uses = 0
        for root in (ROOT / 'src/cuboid_mapping', ROOT / 'include/cuboid_mapping'):
            for file in sorted([*root.rglob('*.h'), *root.rglob('*.cpp')]):
                text = file.read_text()
                folder = str(file.parent.relative_to(root))
                self.assertIn(folder, folders, 'a folder without a row in doc/design.md')
                allowed = folders[:folders.index(folder) + 1]
                for used in re.findall(r'#include "cuboid_mapping/([\w/]+)/\w+\.h"', text):
                    self.assertIn(used, allowed, f'{folder}/{file.name} uses it')
                    num_uses += 1
                if not folder.startswith('ros'):
                    self.assertNotRegex(text, r'#include <(ros/|tf2|\w+_msgs/)', f'{folder}/{file.name}')
        self.assertGreater(num_uses, 500)

    def test_programs_are_parts_of_examples(self):
        num_blocks = 0
        for page in PAGES:
            for language, block in read_blocks(page):
                if language in ('cpp', 'cmake', 'python') and page.name != 'python.md':  # test/python runs its blocks.
                    num_blocks += 1
                    self.assertTrue(any(block in program for program in PROGRAMS), f'{page.name}:\n{block}')
        self.assertGreater(num_blocks, 3)

    def test_the_library_page_begins_with_a_whole_program(self):
        text = (ROOT / 'doc/library.md').read_text()
        for name in ('first_map.cpp', 'CMakeLists.txt'):
            program = (ROOT / 'examples/first_map' / name).read_text()
            self.assertIn(re.sub(r'^// SPDX.*\n', '', program), text)

    def test_commands_name_what_there_is(self):
        num_commands = 0
        for page in PAGES:
            for language, block in read_blocks(page):
                if language == 'sh' and not block.startswith('<'):
                    for words in read_commands(block):
                        num_commands += 1
                        with self.subTest(page=page.name, command=' '.join(words)):
                            self.check_command(*words)
        self.assertGreater(num_commands, 40)

    def test_rosrun_finds_one_program_of_a_name(self):
        """rosrun also takes executable files of the sources: those that are installed must not be."""
        installed = (ROOT / 'cmake' / 'ros_package.cmake').read_text()
        for folder in ('python', 'examples'):
            for file in (ROOT / folder).rglob('*'):
                if file.is_file() and f'{file.relative_to(ROOT)}' in installed:
                    with self.subTest(file=file.name):
                        self.assertFalse(os.access(file, os.X_OK))

    def check_command(self, program, *words):
        """Each program, launch file and its arguments, service and script exists; other tests check that it works."""
        built = '\n'.join((ROOT / path).read_text() for path in (
            'src/programs.cmake', 'benchmark/CMakeLists.txt', 'fuzz/CMakeLists.txt', 'cmake/ros_package.cmake'))
        if program == 'mpirun':
            program, *words = words[2:]
        if program == 'roslaunch':
            package, file, *arguments = [word for word in words if not word.startswith('--')]
            self.assertEqual(package, 'cuboid_mapping')
            declared = re.findall(r'<arg name="(\w+)"', (ROOT / 'launch' / file).read_text())
            for argument in arguments:
                if not argument.startswith('__'):  # Arguments of roslaunch itself.
                    self.assertIn(argument.split(':=')[0], declared)
        elif program == 'rosrun':
            self.assertIn(words[0], ('cuboid_mapping', 'moveit_ros_planning', 'tf2_tools'))
            if words[0] == 'cuboid_mapping':
                self.assertRegex(built, rf'\b{words[1]}\b')
        elif program == 'rosservice':
            service = words[1].split('/')[-1]
            self.assertIn(service, (ROOT / 'src/cuboid_mapping/ros/middleware/names.h').read_text() + ' set_parameters')
        elif program.startswith(('scripts/', 'campaign/')):
            self.assertTrue(os.access(ROOT / program, os.X_OK))
        elif program.startswith('build-fuzz/'):
            self.assertIn(pathlib.Path(program).name, built)
        else:
            self.assertIn(program, OTHERS)
        cmake = '\n'.join(path.read_text() for path in (ROOT / 'CMakeLists.txt', *(ROOT / 'cmake').iterdir()))
        for option in re.findall(r'-D(CUBOID_MAPPING_\w+)', ' '.join(words)):
            self.assertRegex(cmake, rf'(option|set)\({option} ')


if __name__ == '__main__':
    unittest.main()
