#!/usr/bin/python3
"""Checks that links of the Markdown files lead to files and headings that exist, and that every picture is shown.

Exit code 1 with a line for each link that leads nowhere and each picture in doc/images that no page shows.
"""
import re
import sys
from pathlib import Path
from typing import Iterator, List, Set

ROOT = Path(__file__).resolve().parent.parent
FENCE = re.compile(r'^```.*?^```', re.DOTALL | re.MULTILINE)
LINK = re.compile(r'\]\(\s*([^)\s]+)\s*\)|(?:src|href)="([^"]+)"')
HEADING = re.compile(r'^#+ (.*)$', re.MULTILINE)


def text_of(page: Path) -> str:
    return FENCE.sub('', page.read_text(encoding='utf-8'))


def anchor(heading: str) -> str:
    """The anchor that GitHub gives to a heading."""
    return re.sub(r'[^\w\- ]', '', heading.strip().lower()).replace(' ', '-')


def anchors(page: Path) -> Set[str]:
    return {anchor(heading) for heading in HEADING.findall(text_of(page))}


def links(page: Path) -> Iterator[str]:
    """Targets within the repository."""
    for markdown, html in LINK.findall(text_of(page)):
        target = markdown or html
        if not re.match(r'[a-z]+:', target):
            yield target


def broken(page: Path, target: str) -> bool:
    name, _, heading = target.partition('#')
    path = (page.parent / name).resolve() if name else page
    return not path.exists() or (bool(heading) and heading not in anchors(path))


def pages() -> List[Path]:
    return [page for page in sorted(ROOT.rglob('*.md'))
            if not any(part == 'build' or part.startswith('.') for part in page.relative_to(ROOT).parts)]


def main() -> int:
    """Exit code 0 when all links and pictures are right."""
    faults, shown, count = [], set(), 0
    for page in pages():
        for target in links(page):
            count += 1
            shown.add((page.parent / target.partition('#')[0]).resolve())
            if broken(page, target):
                faults.append(f'{page.relative_to(ROOT)}: {target}: leads nowhere')
    faults += [f'{picture.relative_to(ROOT)}: no page shows it'
               for picture in sorted((ROOT / 'doc/images').iterdir()) if picture.resolve() not in shown]
    print(*faults, f'links: {count}, {len(faults)} wrong', sep='\n')
    return 1 if faults else 0


if __name__ == '__main__':
    sys.exit(main())
