#!/usr/bin/python3
"""Counts TRACKING claims that are wrong, in a map of a whole recording and in maps of parts of it.

Maps are made of all images, the first and the last 60 % of them, and of all but the middle third; each is driven by the
whole drive, from several of its images. A claim is wrong beyond --wrong metres; with --wrong -1 every claim is, for
drives in another place than the map. Writes maps and tracks into WORK, and uses those that are there.
"""
import argparse
import csv
import subprocess
import sys
from pathlib import Path
from typing import Dict, List, Tuple

import numpy as np
import rosbag
from local_frame import metres_per_degree

PARTS = {'whole': lambda share: True, 'first 60 %': lambda share: share < 0.6, 'last 60 %': lambda share: share >= 0.4,
         'without a third': lambda share: not 1 / 3 <= share < 2 / 3}
MARGIN_S = 5.0  # fixes around the images of a part


def cut(source: Path, target: Path, topic: str, part: str) -> None:
    """Copies a recording without the images outside of the part; of one that begins or ends there also the fixes."""
    with rosbag.Bag(str(source)) as bag:
        topics = (topic, topic + '/compressed')
        stamps = [message.header.stamp.to_sec() for _, message, _ in bag.read_messages(topics)]
        kept = [stamp for i, stamp in enumerate(stamps) if PARTS[part](i / len(stamps))]
        images, begin, end = set(kept), min(kept) - MARGIN_S, max(kept) + MARGIN_S
        with rosbag.Bag(str(target), 'w') as out:
            for name, message, recorded in bag.read_messages():
                stamp = message.header.stamp.to_sec() if hasattr(message, 'header') else recorded.to_sec()
                if stamp in images if name in topics else begin <= stamp <= end or name.startswith('/tf'):
                    out.write(name, message, recorded)


def run(*command: object) -> None:
    result = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False)
    if result.returncode != 0:
        raise SystemExit('wrong_claims: ' + (result.stderr or result.stdout).strip().splitlines()[-1])


def truth_of(bag: Path, topic: str) -> Tuple[np.ndarray, np.ndarray]:
    """Stamps, and rows of latitude and longitude."""
    with rosbag.Bag(str(bag)) as recording:
        fixes = [message for _, message, _ in recording.read_messages([topic])]
    if not fixes:
        raise SystemExit(f'wrong_claims: {bag} has no message on {topic}')
    return (np.array([fix.header.stamp.to_sec() for fix in fixes]),
            np.array([[fix.latitude, fix.longitude] for fix in fixes]))


def errors_of_claims(track: Path, truth: Tuple[np.ndarray, np.ndarray]) -> List[float]:
    """Of the TRACKING images, metres from the true position nearest in time."""
    stamps, positions = truth
    east_m, north_m = metres_per_degree(float(positions[0, 0]))
    errors = []
    with open(track, newline='', encoding='utf-8') as file:
        for row in csv.DictReader(file):
            if row['state'] != 'TRACKING':
                continue
            latitude, longitude = positions[np.argmin(np.abs(stamps - float(row['stamp'])))]
            errors.append(float(np.hypot((float(row['longitude_deg']) - longitude) * east_m,
                                         (float(row['latitude_deg']) - latitude) * north_m)))
    return errors


def claims(args: argparse.Namespace, part: str) -> List[float]:
    name = part.replace(' %', '').replace(' ', '_')
    common = ['--image-topic', args.image_topic] + (['--camera-info', args.camera_info] if args.camera_info else [])
    bag, built = args.map_bag, args.work / f'{name}.map'
    if part != 'whole':
        bag = args.work / f'{name}.bag'
        if not bag.exists():
            cut(args.map_bag, bag, args.image_topic, part)
    if not built.exists():
        run(args.programs / 'map_builder', '--bag', bag, '--fix-topic', args.fix_topic, '--output', built, *common)
    errors = []
    for start in args.starts:
        track = args.work / f'{name}_{start}.csv'
        if not track.exists():
            run(args.programs / 'localize', '--map', built, '--bag', args.drive_bag, '--seed', 1, '--start-index', start,
                '--output', track, *common)
        errors += errors_of_claims(track, truth_of(args.drive_bag, args.truth_topic))
    return errors


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('map_bag', type=Path, help='recording that becomes the maps')
    parser.add_argument('drive_bag', type=Path, help='recording that is driven')
    parser.add_argument('work', type=Path, help='folder for maps and tracks')
    parser.add_argument('--wrong', type=float, default=10.0, help='metres (default: %(default)s)')
    parser.add_argument('--starts', type=int, nargs='+', default=[0], help='images of the drive to begin with')
    parser.add_argument('--image-topic', default='/stereo/left/image_raw')
    parser.add_argument('--fix-topic', default='/gps/fix', help='positions of the map (default: %(default)s)')
    parser.add_argument('--truth-topic', default='/gps/fix', help='true positions of the drive (default: %(default)s)')
    parser.add_argument('--camera-info', type=Path, help='calibration of both')
    parser.add_argument('--programs', type=Path, default=Path('build/test/devel/lib/visual_localization'))
    args = parser.parse_args()
    args.work.mkdir(parents=True, exist_ok=True)
    totals: Dict[str, int] = {'claims': 0, 'wrong': 0}
    for part in PARTS:
        errors = claims(args, part)
        wrong = [error for error in errors if not error <= args.wrong]
        totals['claims'] += len(errors)
        totals['wrong'] += len(wrong)
        worst = f', worst {max(wrong):.0f} m' if wrong else ''
        print(f'{part}: {len(wrong)} of {len(errors)} claims wrong{worst}', flush=True)
    print(f'together: {totals["wrong"]} of {totals["claims"]}')


if __name__ == '__main__':
    sys.exit(main())
