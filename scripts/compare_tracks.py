#!/usr/bin/python3
"""Shows whether two builds of the package give identical maps and tracks.

Each build makes the maps with its own map_builder and localises with its own localize: every tracker, every kind of
features and every seed, kidnapped and not. Maps are compared row by row, without the package's version. Tracks are
compared as text, column by column, in all columns that both have, without the times (*_ms). What a build made is kept
in --work until one of its files changes. Exit code 0 only when everything is identical.
"""
import argparse
import concurrent.futures
import csv
import functools
import hashlib
import itertools
import os
import shutil
import sqlite3
import subprocess
import sys
import time
from pathlib import Path
from typing import Dict, Iterator, List, NamedTuple, Optional, Set, Tuple, Union

import rosbag

PACKAGE = 'visual_localization'
SAMPLES = Path(__file__).resolve().parent.parent / 'test' / 'data' / 'rounds'
SAMPLE_PAIRS = [('campus_sunny_1', 'campus_cloudy_1')]
FURTHER_PAIRS = [('campus_a_sunny_1', 'campus_a_sunny_2'), ('campus_a_sunny_1', 'campus_a_cloudy_1'),
                 ('kitti_1_map', 'kitti_1_drive')]
TRACKERS = ['dpso', 'pf_gaussian', 'pf_linear']
FEATURES = ['sift', 'global', 'hybrid']
IMAGE_TOPIC = '/stereo/left/image_raw'
FIX_TOPIC = '/gps/fix'
# The checksum covers the version; everything else that it covers is compared.
META_KEYS_LEFT_OUT = ['package_version', 'checksum']
RUN_LIMIT_S = 3600  # of one program


class Failure(Exception):
    """Why there is nothing to compare; the message is the whole answer."""


class Pair(NamedTuple):
    """The bag of a map, and the bag that is localised against it."""

    session: Path
    drive: Path

    def __str__(self) -> str:
        return f'{self.session.stem} -> {self.drive.stem}'


class Run(NamedTuple):
    """One run of localize over a drive."""

    tracker: str
    features: str
    seed: int
    kidnapping: Optional[Dict[str, int]]

    def options(self) -> List[str]:
        options = ['--tracker', self.tracker, '--features', self.features, '--seed', str(self.seed)]
        for name, value in (self.kidnapping or {}).items():
            options += [f'--kidnap-{name}', str(value)]
        return options

    def file_name(self) -> str:
        """Of the track; says all that makes the run."""
        jump = '_kidnapped_{at}_to_{to}'.format(**self.kidnapping) if self.kidnapping else ''
        return f'{self.tracker}_{self.features}_seed_{self.seed}{jump}.csv'


class Table(NamedTuple):
    """Rows of text."""

    columns: List[str]
    rows: List[Dict[str, str]]


class Build:
    """One build of the package, with the folder that keeps what it made."""

    def __init__(self, root: Path, work: Path):
        self.root = root
        self._localize, self._map_builder = self._find('localize'), self._find('map_builder')
        self._libraries = self._localize.parents[1]
        self._key = self._fingerprint()
        self.folder = work / f'{root.name}_{hashlib.sha256(os.fsencode(root)).hexdigest()[:12]}'
        self._forget_if_changed()

    def _find(self, name: str) -> Path:
        for folder in ('devel', '.', 'install'):  # a build may hold its own installation, too
            path = self.root / folder / 'lib' / PACKAGE / name
            if path.is_file():
                return path
        raise Failure(f'{self.root} holds no lib/{PACKAGE}/{name}, in devel or install neither')

    def _fingerprint(self) -> str:
        libraries = sorted(self._libraries.glob(f'lib{PACKAGE}*.so*'))
        lines = []
        for path in [self._localize, self._map_builder] + libraries:
            status = path.stat()
            lines.append(f'{path} {status.st_size} {status.st_mtime_ns}\n')
        return ''.join(lines)

    def _forget_if_changed(self) -> None:
        key_file = self.folder / 'build.txt'
        if key_file.is_file() and key_file.read_text(encoding='utf-8') == self._key:
            return
        if key_file.is_file():
            shutil.rmtree(self.folder)
        if self.folder.exists() and any(self.folder.iterdir()):
            raise Failure(f'{self.folder} was not made by compare_tracks (it has no build.txt): name another --work')
        self.folder.mkdir(parents=True, exist_ok=True)
        key_file.write_text(self._key, encoding='utf-8')

    def map_file(self, session: Path) -> Path:
        """Where the map of a bag is or will be; another content of the bag gives another file."""
        return self.folder / f'{session.stem}_{content_of(session)}.map'

    def track_file(self, pair: Pair, run: Run) -> Path:
        folder = f'{self.map_file(pair.session).stem}_to_{pair.drive.stem}_{content_of(pair.drive)}'
        return self.folder / folder / run.file_name()

    def make_map(self, session: Path) -> None:
        """Builds the map of a bag, unless it is there."""
        self._make(self.map_file(session), [self._map_builder, '--bag', session, '--image-topic', IMAGE_TOPIC,
                                            '--fix-topic', FIX_TOPIC])

    def make_track(self, pair: Pair, run: Run) -> bool:
        """Localises a drive; False when its track is there already."""
        return self._make(self.track_file(pair, run), [self._localize, '--map', self.map_file(pair.session), '--bag',
                                                       pair.drive, '--image-topic', IMAGE_TOPIC] + run.options())

    def _make(self, output: Path, command: List[Union[str, Path]]) -> bool:
        """Runs a program that writes `output`; False when that is there already."""
        if output.is_file():
            return False
        output.parent.mkdir(exist_ok=True)
        partial = output.with_name(f'{output.name}.{os.getpid()}')
        paths = [str(self._libraries), os.environ.get('LD_LIBRARY_PATH', '')]
        environment = dict(os.environ, LD_LIBRARY_PATH=':'.join(path for path in paths if path))
        try:
            subprocess.run(command + ['--output', partial], env=environment, check=True, timeout=RUN_LIMIT_S,
                           stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
            if self._fingerprint() != self._key:
                raise Failure(f'{self.root} changed during the run')
            partial.replace(output)
        except subprocess.CalledProcessError as error:
            said = error.stderr.decode(errors='replace').strip().splitlines() or ['no message']
            raise Failure(f'{command[0]} ended with {error.returncode}: {said[-1]}') from error
        except (subprocess.TimeoutExpired, OSError) as error:
            raise Failure(str(error)) from error
        finally:
            if partial.exists():
                partial.unlink()
        return True


@functools.lru_cache(maxsize=None)
def content_of(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()[:12]


def count_images(bag: Path) -> int:
    try:
        with rosbag.Bag(str(bag)) as file:
            count = file.get_message_count([IMAGE_TOPIC, IMAGE_TOPIC + '/compressed'])
    except (rosbag.ROSBagException, OSError) as error:
        raise Failure(f'{bag}: {error}') from error
    if count < 2:
        raise Failure(f'{bag} holds {count} images on {IMAGE_TOPIC}')
    return count


def runs_over(drive: Path, seeds: List[int]) -> List[Run]:
    """All runs; the kidnapped are carried by half of the drive after half of it, as in the experiments."""
    images = count_images(drive)
    half = images // 2
    kidnappings = [None, {'at': half, 'to': 2 * half % images}]
    return [Run(*choice) for choice in itertools.product(TRACKERS, FEATURES, seeds, kidnappings)]


def read_track(path: Path) -> Table:
    with open(path, newline='', encoding='utf-8') as file:
        lines = list(csv.reader(file))
    if len(lines) < 2:
        raise Failure(f'{path} has no rows')
    if any(len(line) != len(lines[0]) for line in lines):
        raise Failure(f'{path} has rows of different length')
    return Table(lines[0], [dict(zip(lines[0], line)) for line in lines[1:]])


def text_of(value: object) -> str:
    """A value of a map, exact; of bytes a hash."""
    return f'{len(value)} bytes {hashlib.sha256(value).hexdigest()[:16]}' if isinstance(value, bytes) else repr(value)


def read_map(path: Path) -> Dict[str, Table]:
    """Every table of a map file."""
    tables = {}
    try:
        database = sqlite3.connect(f'{path.resolve().as_uri()}?mode=ro', uri=True)
        try:
            for (name,) in database.execute("SELECT name FROM sqlite_master WHERE type = 'table'").fetchall():
                cursor = database.execute(f'SELECT * FROM "{name}" ORDER BY 1')
                columns = [column[0] for column in cursor.description]
                rows = [dict(zip(columns, map(text_of, row))) for row in cursor]
                tables[name] = Table(columns, rows)
        finally:
            database.close()
    except sqlite3.Error as error:
        raise Failure(f'{path}: {error}') from error
    if not tables.get('images', Table([], [])).rows:
        raise Failure(f'{path} holds no images')
    left_out = [text_of(key) for key in META_KEYS_LEFT_OUT]
    if 'meta' in tables:
        tables['meta'].rows[:] = [row for row in tables['meta'].rows if row['key'] not in left_out]
    return tables


def difference(before: Table, after: Table, columns: List[str]) -> Optional[str]:
    """Where two tables differ first and how much there is of it; None when they are equal."""
    if not columns:
        return 'no column in common'
    first, rows, differing = '', 0, []
    for number, (old, new) in enumerate(zip(before.rows, after.rows), 1):
        others = [column for column in columns if old[column] != new[column]]
        if not others:
            continue
        first = first or f'row {number}, {others[0]}: {old[others[0]]} -> {new[others[0]]}'
        rows += 1
        differing += [column for column in others if column not in differing]
    found = [f'{first} (rows that differ: {rows}, in {", ".join(differing)})'] if rows else []
    if len(before.rows) != len(after.rows):
        found.append(f'{len(before.rows)} -> {len(after.rows)} rows')
    return '; '.join(found) or None


def map_difference(before: Path, after: Path) -> Optional[str]:
    """Where two maps differ first; None when they are equal."""
    old, new = read_map(before), read_map(after)
    if set(old) != set(new):
        return f'tables {", ".join(sorted(old))} -> {", ".join(sorted(new))}'
    for name in old:
        if old[name].columns != new[name].columns:
            return f'{name}: columns {", ".join(old[name].columns)} -> {", ".join(new[name].columns)}'
        found = difference(old[name], new[name], old[name].columns)
        if found:
            return f'{name}: {found}'
    return None


class Comparison:
    """Compares two builds pair by pair and keeps the score."""

    def __init__(self, before: Build, after: Build, jobs: int):
        self._builds = (before, after)
        self._jobs = jobs
        self._maps: Dict[Path, Optional[str]] = {}
        self._only: Tuple[Set[str], Set[str]] = (set(), set())  # columns that the other build does not write
        self._runs = 0
        self.tracks = self.identical = self.failures = 0

    def compare(self, pair: Pair, seeds: List[int]) -> None:
        """Makes what is missing, prints one line and the differences."""
        begin, runs_before = time.monotonic(), self._runs
        runs = runs_over(pair.drive, seeds)
        if pair.session not in self._maps:
            for build in self._builds:
                build.make_map(pair.session)
            self._maps[pair.session] = map_difference(*(build.map_file(pair.session) for build in self._builds))
        map_found = self._maps[pair.session]
        reasons = self._make_tracks(pair, runs)
        different = [f'{run.file_name()}: {reason}' for run, reason in self._compare_tracks(pair, runs, reasons)]
        self.tracks += len(runs)
        self.identical += len(runs) - len(different)
        self.failures += len(different) + (map_found is not None)
        print(f'{pair}: {len(runs) - len(different)} of {len(runs)} tracks identical, map '
              f'{"identical" if map_found is None else "different"} ({self._runs - runs_before} runs of localize, '
              f'{time.monotonic() - begin:.0f} s)')
        for line in ([f'map: {map_found}'] if map_found else []) + different:
            print(f'  {line}')
        sys.stdout.flush()

    def _make_tracks(self, pair: Pair, runs: List[Run]) -> Dict[Path, str]:
        """Runs localize where a track is missing; the reason for every track that could not be made."""
        # By file: a build that is compared with itself runs once.
        tasks = {build.track_file(pair, run): (build, run) for build in self._builds for run in runs}
        reasons = {}
        with concurrent.futures.ThreadPoolExecutor(self._jobs) as pool:
            futures = {pool.submit(build.make_track, pair, run): path for path, (build, run) in tasks.items()}
            try:
                for done, future in enumerate(concurrent.futures.as_completed(futures), 1):
                    try:
                        self._runs += future.result()
                    except Failure as failure:
                        reasons[futures[future]] = str(failure)
                    show_progress(f'{pair}: {done} of {len(tasks)} tracks')
            finally:
                for future in futures:
                    future.cancel()
        show_progress('')
        return reasons

    def _compare_tracks(self, pair: Pair, runs: List[Run], reasons: Dict[Path, str]) -> Iterator[Tuple[Run, str]]:
        """Yields every run whose tracks differ or are missing, with the reason."""
        for run in runs:
            paths = [build.track_file(pair, run) for build in self._builds]
            missing = [reasons[path] for path in paths if path in reasons]
            found = '; '.join(missing) if missing else self._track_difference(*paths)
            if found:
                yield run, found

    def _track_difference(self, before: Path, after: Path) -> Optional[str]:
        try:
            old, new = read_track(before), read_track(after)
        except Failure as failure:
            return str(failure)
        self._only[0].update(set(old.columns) - set(new.columns))
        self._only[1].update(set(new.columns) - set(old.columns))
        common = [column for column in old.columns if column in new.columns and not column.endswith('_ms')]
        return difference(old, new, common)

    def print_summary(self) -> None:
        """The columns that were not compared, and the result of all pairs."""
        for option, columns in zip(('--before', '--after'), self._only):
            if columns:
                print(f'columns that only {option} has: {", ".join(sorted(columns))}')
        maps = sum(found is None for found in self._maps.values())
        print(f'{self.identical} of {self.tracks} tracks and {maps} of {len(self._maps)} maps identical')


def show_progress(text: str) -> None:
    """One line that renews itself; nothing when nobody looks."""
    if sys.stderr.isatty():
        print(f'\r\033[K{text}', end='', file=sys.stderr, flush=True)


def pairs_of(rounds: Optional[Path]) -> List[Pair]:
    """The sample pair, and those of a folder."""
    pairs = [Pair(SAMPLES / f'{session}.bag', SAMPLES / f'{drive}.bag') for session, drive in SAMPLE_PAIRS]
    if rounds:
        pairs += [Pair(rounds / f'{session}.bag', rounds / f'{drive}.bag') for session, drive in FURTHER_PAIRS]
    for bag in itertools.chain(*pairs):
        if not bag.is_file():
            raise Failure(f'{bag} does not exist')
    return pairs


def positive(text: str) -> int:
    number = int(text)
    if number < 1:
        raise ValueError
    return number


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--before', type=Path, required=True, metavar='BUILD_DIR', help='build folder to compare with')
    parser.add_argument('--after', type=Path, required=True, metavar='BUILD_DIR', help='build folder to judge')
    parser.add_argument('--rounds', type=Path, default=os.environ.get(PACKAGE.upper() + '_DATA') or None,
                        metavar='DIR', help='folder of further bags (default: $VISUAL_LOCALIZATION_DATA)')
    # Not in the temporary directory: anybody could make a folder of that name there before.
    cache = Path(os.environ.get('XDG_CACHE_HOME') or Path.home() / '.cache')
    parser.add_argument('--work', type=Path, default=cache / f'{PACKAGE}_tracks', metavar='DIR',
                        help='keeps maps and tracks of each build (default: %(default)s)')
    parser.add_argument('--jobs', type=positive, default=2, help='runs at the same time (default: %(default)s)')
    parser.add_argument('--seeds', type=int, nargs='+', default=[1, 2, 3], help='of the trackers (default: 1 2 3)')
    parser.add_argument('--quick', action='store_true', help='only the sample pair')
    return parser.parse_args()


def main() -> int:
    """Compares pair by pair; 1 when something differs, fails or is missing."""
    args = parse_arguments()
    try:
        pairs = pairs_of(None if args.quick else args.rounds)
        before, after = (Build(root.resolve(), args.work.resolve()) for root in (args.before, args.after))
        if before.folder == after.folder:
            print('--before and --after are the same build: its tracks are compared with themselves')
        comparison = Comparison(before, after, args.jobs)
        for pair in pairs:
            try:
                comparison.compare(pair, sorted(set(args.seeds)))
            except Failure as failure:
                comparison.failures += 1
                print(f'{pair}: failed: {failure}', flush=True)
    except (Failure, OSError) as failure:
        print(f'compare_tracks: {failure}', file=sys.stderr)
        return 1
    comparison.print_summary()
    return 0 if comparison.tracks and not comparison.failures else 1


if __name__ == '__main__':
    sys.exit(main())
