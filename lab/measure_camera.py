#!/usr/bin/python3
"""Measures what faults of the camera do to the localizer: drives rounds whose images are spoilt and judges the states.

Builds a map of one round, spoils the images of others and runs `localize` on them. Prints a Markdown table. Needs the
programs of this package (--programs, or on the PATH), rosbag, OpenCV and numpy.
"""
import argparse
import csv
import math
import shutil
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Dict, Iterator, List, NamedTuple, Optional, Sequence

import cv2
import numpy as np
import rosbag
from sensor_msgs.msg import CompressedImage

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / 'test/support'))
from camera_faults import FAULTS, Fault, soiled  # noqa: E402

IMAGES = '/stereo/left/image_raw'
FIXES = '/gps/fix'
TRUTH = '/ground_truth/fix'
SOILED_MAP = 'dirt of the map'
WRONG_M, FAR_M = 5.0, 10.0
FROZEN_FROM, FROZEN_UNTIL = 150, 210
EARTH_RADIUS_M = 6371000.0


class Row(NamedTuple):
    """What was said about one image, beside the truth."""
    number: int
    state: str
    error_m: float


def decoded(message: CompressedImage) -> np.ndarray:
    return cv2.imdecode(np.frombuffer(message.data, np.uint8), cv2.IMREAD_GRAYSCALE)


def spoil(source: Path, target: Path, fault: Fault, seed: int) -> None:
    """Copies a bag with every image spoilt. PNG: no second loss by compression, as none of the faults makes one."""
    generator = np.random.default_rng(seed)
    with rosbag.Bag(str(source)) as bag, rosbag.Bag(str(target), 'w') as out:
        number = 0
        for topic, message, stamp in bag.read_messages([IMAGES + '/compressed', FIXES, TRUTH]):
            if topic == IMAGES + '/compressed':
                pixels = fault(decoded(message), number, generator)
                message.format = 'png'
                message.data = cv2.imencode('.png', pixels, [cv2.IMWRITE_PNG_COMPRESSION, 1])[1].tobytes()
                number += 1
            out.write(topic, message, stamp)


class FrozenCamera:
    """Shows one image again and again for a while."""

    def __init__(self) -> None:
        self._held: Optional[np.ndarray] = None

    def __call__(self, grey: np.ndarray, number: int, _: np.random.Generator) -> np.ndarray:
        if self._held is None or not FROZEN_FROM < number < FROZEN_UNTIL:
            self._held = grey
        return self._held


def truth_of(bag: Path) -> Dict[str, Sequence[float]]:
    """Exact latitude and longitude by stamp, as a track writes stamps."""
    with rosbag.Bag(str(bag)) as file:
        return {f'{fix.header.stamp.secs}.{fix.header.stamp.nsecs:09d}': (fix.latitude, fix.longitude)
                for _, fix, _ in file.read_messages([TRUTH])}


def distance_m(a: Sequence[float], b: Sequence[float]) -> float:
    north = math.radians(a[0] - b[0])
    east = math.radians(a[1] - b[1]) * math.cos(math.radians(b[0]))
    return EARTH_RADIUS_M * math.hypot(north, east)


class Programs:
    """The programs of this package."""

    def __init__(self, folder: Optional[Path]):
        self._folder = folder

    def run(self, name: str, *arguments: object) -> None:
        """Fails with what the program said."""
        program = str(self._folder / name) if self._folder else name
        if shutil.which(program) is None:
            raise SystemExit(f'measure_camera: {program} is not there: name its folder by --programs')
        done = subprocess.run([program, *map(str, arguments)], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                              stderr=subprocess.PIPE, check=False, universal_newlines=True)
        if done.returncode != 0:
            raise SystemExit(f'measure_camera: {name}: {done.stderr.strip()}')

    def build_map(self, bag: Path, target: Path) -> None:
        self.run('map_builder', '--bag', bag, '--image-topic', IMAGES, '--fix-topic', FIXES, '--output', target)

    def drive(self, bag: Path, map_file: Path, start: int, options: List[str]) -> List[Row]:
        """What the localizer says about a round from image `start` on, in the order it was driven."""
        with tempfile.TemporaryDirectory() as folder:
            track = Path(folder) / 'track.csv'
            self.run('localize', '--map', map_file, '--bag', bag, '--image-topic', IMAGES, '--output', track,
                     '--start-index', start, *options)
            with track.open(encoding='utf-8') as file:
                rows = list(csv.DictReader(file))
        truth = truth_of(bag)
        count = len(rows)
        return [Row((start + i) % count, row['state'],
                    distance_m((float(row['latitude_deg']), float(row['longitude_deg'])), truth[row['stamp']]))
                for i, row in enumerate(rows) if row['stamp'] in truth]


def table_row(name: str, rows: List[Row]) -> str:
    """Shares in per cent, errors in metres."""
    if not rows:
        sys.exit(f'measure_camera: no image to judge for "{name}": the round is too short')
    tracking = [row.error_m for row in rows if row.state == 'TRACKING']
    wrong, far = (sum(error > limit_m for error in tracking) for limit_m in (WRONG_M, FAR_M))
    share = f'{100.0 * len(tracking) / len(rows):.1f}'
    wrong_share = f'{100.0 * wrong / len(tracking):.1f} ({wrong} of {len(tracking)})' if tracking else 'no claim'
    far_share = f'{100.0 * far / len(tracking):.1f}' if tracking else '-'
    mean = f'{statistics.mean(tracking):.2f}' if tracking else '-'
    return f'| {name} | {len(rows)} | {share} | {wrong_share} | {far_share} | {mean} | ' \
           f'{statistics.median(row.error_m for row in rows):.2f} |'


def until_tracking_again(rows: List[Row]) -> Optional[int]:
    """Images from the first one that is no longer frozen until TRACKING."""
    after = [row for row in rows if row.number >= FROZEN_UNTIL]
    return next((i for i, row in enumerate(after, 1) if row.state == 'TRACKING'), None)


class Measurement:
    """Drives every round with a fault from several start images."""

    def __init__(self, args: argparse.Namespace, folder: Path):
        self._programs = Programs(args.programs)
        self._args = args
        self._folder = folder
        self._map = folder / 'map.map'
        self._programs.build_map(args.map_bag, self._map)

    def _drives(self, fault: Fault, map_file: Path, starts: Sequence[int]) -> Iterator[List[Row]]:
        spoilt = self._folder / 'spoilt.bag'
        for bag in self._args.bags:
            spoil(bag, spoilt, fault, seed=1)
            for start in starts:
                yield self._programs.drive(spoilt, map_file, start, self._args.localize)

    def with_fault(self, name: str, fault: Fault, map_file: Optional[Path] = None) -> None:
        """Prints a row of the table."""
        drives = list(self._drives(fault, map_file or self._map, self._args.starts))
        print(table_row(name, sum(drives, [])), flush=True)

    def frozen(self) -> None:
        """Judges the frozen images, and counts what it takes afterwards."""
        drives = list(self._drives(FrozenCamera(), self._map, [0]))
        frozen = [row for drive in drives for row in drive if FROZEN_FROM < row.number < FROZEN_UNTIL]
        print(table_row('frozen, the frozen images only', frozen), flush=True)
        again = ', '.join(str(until_tracking_again(drive)) for drive in drives)
        print(f'\nTRACKING again on image {again} after the frozen ones (one number a round)')

    def dirt_of_the_map(self) -> None:
        """The same dirt was on the lens when the map was made."""
        spoilt, map_file = self._folder / 'spoilt_map.bag', self._folder / 'soiled.map'
        for radius, name in ((0.2, '10 %'), (0.4, '38 %')):
            def fault(grey: np.ndarray, _: int, __: np.random.Generator, radius: float = radius) -> np.ndarray:
                return soiled(grey, radius)
            spoil(self._args.map_bag, spoilt, fault, seed=2)
            map_file.unlink(missing_ok=True)
            self._programs.build_map(spoilt, map_file)
            self.with_fault(f'the same dirt on {name}, in the map as well', fault, map_file)


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--map-bag', type=Path, required=True, help='round that the map is made of')
    parser.add_argument('--bags', type=Path, nargs='+', required=True, help='rounds to drive')
    parser.add_argument('--starts', type=int, nargs='+', default=[0, 200], help='first images (default: 0 200)')
    parser.add_argument('--programs', type=Path, help='folder of map_builder and localize (default: the PATH)')
    parser.add_argument('--only', nargs='+', choices=[*FAULTS, SOILED_MAP, 'frozen'], metavar='FAULT',
                        help='these faults only: ' + ', '.join([*FAULTS, SOILED_MAP, 'frozen']).replace('%', '%%'))
    parser.add_argument('--localize', nargs=argparse.REMAINDER, default=[], help='options of localize; comes last')
    return parser.parse_args()


def main() -> None:
    args = parse_arguments()
    with tempfile.TemporaryDirectory() as folder:
        measurement = Measurement(args, Path(folder))
        print(f'| fault | images | TRACKING % | of these wrong by > {WRONG_M:.0f} m, % | by > {FAR_M:.0f} m, % | '
              'mean error of TRACKING, m | median error of all, m |\n|---|---|---|---|---|---|---|')
        for name, fault in FAULTS.items():
            if args.only is None or name in args.only:
                measurement.with_fault(name, fault)
        if args.only is None or SOILED_MAP in args.only:
            measurement.dirt_of_the_map()
        if args.only is None or 'frozen' in args.only:
            measurement.frozen()


if __name__ == '__main__':
    main()
