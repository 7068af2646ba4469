#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes a page that searches the text of all guides of the site, because the search of doxygen only finds names.

usage: scripts/search_page.py FOLDER          the html folder that doxygen has written
"""
import html
import json
import pathlib
import re
import sys

PAGE = '''<!DOCTYPE html>
<!-- SPDX-License-Identifier: BSD-3-Clause -->
<html lang="en"><head><meta charset="utf-8"><title>cuboid_mapping: search guides</title>
<link href="doxygen.css" rel="stylesheet"><style>body {{ margin: 2em; max-width: 60em }} input {{ font-size: 1.2em; width: 100% }}</style></head>
<body><p><a href="index.html">cuboid_mapping</a></p>
<input id="words" type="search" placeholder="Words, such as: autosave" autofocus><div id="found"></div>
<script>
const sections = {sections};
// Sections with all words, those with the words in their titles first.
function find(text) {{
  const words = text.toLowerCase().split(/\\s+/).filter(word => word);
  const has = (text, word) => text.toLowerCase().includes(word);
  const score = section => words.filter(word => has(section.title, word)).length;
  return sections.filter(section => words.length && words.every(word => has(section.title + ' ' + section.text, word)))
    .sort((a, b) => score(b) - score(a)).slice(0, 50);
}}
function show() {{
  const words = document.getElementById('words').value, list = document.getElementById('found');
  list.replaceChildren(...find(words).map(section => {{
    const item = document.createElement('p'), link = document.createElement('a');
    const at = section.text.toLowerCase().indexOf(words.toLowerCase().trim().split(/\\s+/)[0]);
    link.href = section.url;
    link.textContent = section.title;
    item.append(link, document.createElement('br'), section.text.slice(Math.max(0, at - 80), at + 160));
    return item;
  }}));
}}
if (typeof document !== 'undefined') document.getElementById('words').addEventListener('input', show);
</script></body></html>
'''


def to_text(markup):
    return ' '.join(html.unescape(re.sub(r'<[^>]*>', ' ', markup)).split())


def read_sections(file):
    """Title, address and text of each section of a page."""
    content = file.read_text(encoding='utf-8')
    page = to_text(re.search(r'<div class="title">(.*?)</div>', content, re.DOTALL).group(1))
    body = re.search(r'<div class="textblock">(.*)</div><!-- contents -->', content, re.DOTALL).group(1)
    first, *rest = re.split(r'<h[1-4]><a class="anchor" id="(\w+)"></a>', body)
    yield {'title': page, 'url': file.name, 'text': to_text(first)}
    for anchor, part in zip(rest[::2], rest[1::2]):
        title, _, text = re.sub(r'</h[1-4]>', '\0', part, count=1).partition('\0')
        yield {'title': f'{page}: {to_text(title)}', 'url': f'{file.name}#{anchor}', 'text': to_text(text)}


def main():
    if len(sys.argv) != 2 or sys.argv[1] in ('-h', '--help'):
        sys.exit(__doc__)
    folder = pathlib.Path(sys.argv[1])
    files = [folder / 'index.html', *sorted(folder.glob('md_*.html'))]
    sections = [section for file in files for section in read_sections(file)]
    (folder / 'search_guides.html').write_text(PAGE.format(sections=json.dumps(sections).replace('</', '<\\/')), encoding='utf-8')


if __name__ == '__main__':
    main()
