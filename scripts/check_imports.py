#!/usr/bin/python3
"""Checks that imports run one way, that public headers need no private one, and that few folders know ROS.

A folder of src/ and include/visual_localization/ may include its own headers and those of the folders above it in
the list of doc/architecture.md.
"""
import argparse
import re
import sys
from pathlib import Path
from typing import Iterator, List, Optional, Tuple

PACKAGE = 'visual_localization'
ARCHITECTURE = Path(__file__).resolve().parent.parent / 'doc' / 'architecture.md'
KNOWS_ROS = {'ros', 'bag', 'node', 'apps'}
READS_BAGS = {'round_recorder'}  # of evaluation/: the rest of it belongs to the library without ROS
INCLUDE = re.compile(r'^\s*#\s*include\s*[<"]([^>"]+)[>"]')
ROS_HEADER = re.compile(
    r'^(ros|rosbag|roscpp|nodelet|pluginlib|class_loader|camera_calibration_parsers|cv_bridge|image_transport|'
    r'message_filters|tf2?|tf2_\w+|\w+_msgs|std_srvs|diagnostic_updater|dynamic_reconfigure|topic_tools|bondcpp)/')


def written_order() -> List[str]:
    """The folders of src/ as doc/architecture.md lists them, top to bottom."""
    listing = re.search(r'^src/ .*?\n(.*?)^\S', ARCHITECTURE.read_text(encoding='utf-8'), re.DOTALL | re.MULTILINE)
    folders = re.findall(r'^  (\w+)/ ', listing.group(1), re.MULTILINE) if listing else []
    if not folders:
        sys.exit(f'{ARCHITECTURE}: there is no list of the folders of src/')
    return folders


ORDER = written_order()


def includes(path: Path) -> Iterator[Tuple[int, str]]:
    for number, line in enumerate(path.read_text(encoding='utf-8').splitlines(), 1):
        match = INCLUDE.match(line)
        if match:
            yield number, match.group(1)


def sources(root: Path) -> Iterator[Path]:
    for folder in (root / 'include' / PACKAGE, root / 'src', root / 'test'):
        for pattern in ('*.h', '*.hpp', '*.cpp'):
            yield from sorted(folder.rglob(pattern))


def folder_of(path: Path, root: Path) -> str:
    """The folder whose rules hold for a file; that of a test is the one it mirrors."""
    parts = path.relative_to(root).parts
    return parts[2] if parts[0] == 'include' else parts[1]


def violation(folder: str, header: str, is_test: bool, is_public: bool) -> Optional[str]:
    """What is wrong with including `header` from `folder`, in words."""
    parts = header.split('/')
    ours = parts[0] == PACKAGE
    private = parts[0] in ORDER and len(parts) > 1
    generated = ours and len(parts) == 2  # a message or a service
    if (ROS_HEADER.match(header) and not private or generated) and folder not in KNOWS_ROS:
        return None if is_test and folder not in ORDER else f'{folder}/ must not know ROS'
    if private and is_public:
        return 'a public header must not need a private one'
    target = parts[0] if private else parts[1] if ours and len(parts) > 2 else None
    if is_test or target is None:
        return None
    if target not in ORDER:
        return f'{target}/ has no place in the order'
    if folder in ORDER and ORDER.index(target) > ORDER.index(folder):
        return f'{target}/ comes after {folder}/'
    return None


def main() -> int:
    """Prints every violation; 1 when there is one."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--root', type=Path, default=Path(__file__).resolve().parent.parent, help='the package')
    root = parser.parse_args().root.resolve()
    files = found = 0
    for path in sources(root):
        files += 1
        folder, is_test = folder_of(path, root), path.relative_to(root).parts[0] == 'test'
        if not is_test and folder not in ORDER:
            print(f'{path.relative_to(root)}: {folder}/ has no place in the order')
            found += 1
        is_public = path.relative_to(root).parts[0] == 'include'
        for line, header in includes(path):
            problem = violation(folder, header, is_test, is_public)
            if not is_test and folder == 'evaluation' and path.stem not in READS_BAGS and 'bag/' in header:
                problem = 'only round_recorder may read bags here'
            if problem:
                print(f'{path.relative_to(root)}:{line}: includes {header}: {problem}')
                found += 1
    print(f'imports: {files} files, {found} in the wrong direction')
    return 1 if found or not files else 0


if __name__ == '__main__':
    sys.exit(main())
