#!/usr/bin/python3
"""Checks that files that are compiled together have no private name in common: a unity build makes several one.

Private are names in an unnamed namespace. A build notices only within a batch, and every new file moves the others to
other batches.
"""
import re
import sys
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
# What is built in batches: the library of src/CMakeLists.txt and each program of test/CMakeLists.txt.
LIBRARY = ('src/ros/*.cpp', 'src/bag/*.cpp', 'src/node/*.cpp', 'src/evaluation/round_recorder.cpp')
TESTS = 'test/*/*_test.cpp'
BLOCK = re.compile(r'^namespace \{\n(.*?)^\}  // namespace\n', re.DOTALL | re.MULTILINE)
TYPE = re.compile(r'^(?:class|struct|enum class|enum|union) (\w+)', re.MULTILINE)
ALIAS = re.compile(r'^using (\w+) = (.*?);', re.DOTALL | re.MULTILINE)
OTHER = re.compile(
    r'^(?!using|template|class|struct|enum|union|TEST|INSTANTIATE|//|#|\}|\s)'
    r'[^\n=;({]*?\b(\w+)(?:\[\w*\])?(?:\(| =|\{|;)', re.MULTILINE)


def private_names(text: str) -> dict:
    """What a source defines in unnamed namespaces, at their first level; for an alias, what it stands for."""
    blocks = BLOCK.findall(text)
    names = {match.group(1): '' for block in blocks for kind in (TYPE, OTHER) for match in kind.finditer(block)}
    names.update(match.groups() for block in blocks for match in ALIAS.finditer(block))
    return names


def programs() -> list:
    """The files that may get into one batch, a list for each library or program."""
    library = [path for pattern in LIBRARY for path in sorted(ROOT.glob(pattern))]
    tests = defaultdict(list)
    for path in sorted(ROOT.glob(TESTS)):
        tests[path.parent].append(path)
    return [library, *tests.values()]


def main() -> int:
    """One line for each name that several files define."""
    names = files = shared = 0
    for program in programs():
        where, meanings = defaultdict(list), defaultdict(set)
        for path in program:
            for name, meaning in private_names(path.read_text(encoding='utf-8')).items():
                where[name].append(str(path.relative_to(ROOT)))
                meanings[name].add(meaning)
        for name, paths in sorted(where.items()):
            if len(paths) > 1 and (len(meanings[name]) > 1 or '' in meanings[name]):
                print(f'{name} is defined in {" and ".join(paths)}: a unity build refuses one of them', file=sys.stderr)
                shared += 1
        names += len(where)
        files += len(program)
    print(f'private names: {names} in {files} files, {shared} shared')
    return 1 if shared else 0


if __name__ == '__main__':
    sys.exit(main())
