#!/usr/bin/python3
"""Checks that files of the ROS library have no private name in common: a unity build compiles several as one.

Private are names in an unnamed namespace. A build notices only within a batch, and every new file moves the others to
other batches.
"""
import re
import sys
from collections import defaultdict
from pathlib import Path

# Of the library that is built in batches, see src/CMakeLists.txt.
SOURCES = ('ros/*.cpp', 'bag/*.cpp', 'node/*.cpp', 'evaluation/round_recorder.cpp')
BLOCK = re.compile(r'^namespace \{\n(.*?)^\}  // namespace\n', re.DOTALL | re.MULTILINE)
TYPE = re.compile(r'^(?:class|struct|enum class|enum|union) (\w+)', re.MULTILINE)
OTHER = re.compile(
    r'^(?!using|template|class|struct|enum|union|//|#|\}|\s)[^\n=;({]*?\b(\w+)(?:\[\w*\])?(?:\(| =|\{|;)', re.MULTILINE)


def private_names(text: str) -> set:
    """What a source defines in unnamed namespaces, at their first level."""
    return {match.group(1) for block in BLOCK.findall(text) for kind in (TYPE, OTHER) for match in kind.finditer(block)}


def main() -> int:
    """One line for each name that several files define."""
    root = Path(__file__).resolve().parent.parent / 'src'
    files = [path for pattern in SOURCES for path in sorted(root.glob(pattern))]
    where = defaultdict(list)
    for path in files:
        for name in private_names(path.read_text(encoding='utf-8')):
            where[name].append(str(path.relative_to(root)))
    shared = {name: paths for name, paths in where.items() if len(paths) > 1}
    for name, paths in sorted(shared.items()):
        print(f'{name} is defined in {" and ".join(paths)}: a unity build refuses one of them', file=sys.stderr)
    print(f'private names: {len(where)} in {len(files)} files, {len(shared)} shared')
    return 1 if shared else 0


if __name__ == '__main__':
    sys.exit(main())
