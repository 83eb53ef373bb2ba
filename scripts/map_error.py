#!/usr/bin/python3
"""Compares a map with the truth: where its training images are off, and whether two sessions have one place twice.

Each bag has the true positions of the session that is named after it. Prints for each session the distance of its
images from them, and for each session but the first one how far it has the same place apart from those before: the
difference of the errors of two images within 3 m of each other. Several maps count as one.
"""
import argparse
import csv
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Dict, List

import matplotlib
import numpy as np
from matplotlib import pyplot
from local_frame import LocalFrame, fixes_of

NEAR_M = 3.0
matplotlib.use('Agg')


def images_of(map_file: Path, programs: Path) -> List[Dict[str, str]]:
    """Rows of map_info's table of images."""
    with tempfile.TemporaryDirectory() as folder:
        table = Path(folder) / 'images.csv'
        subprocess.run([programs / 'map_info', map_file, '--export-csv', table], check=True,
                       stdout=subprocess.DEVNULL)
        with open(table, newline='', encoding='utf-8') as file:
            return list(csv.DictReader(file))


def truth_of(bag: Path, topic: str, frame: LocalFrame) -> np.ndarray:
    """Rows of stamp, east and north."""
    fixes = fixes_of(bag, topic)
    return np.column_stack((fixes[:, 0], frame.position(fixes[:, 1], fixes[:, 2])))


def errors_of(images: List[Dict[str, str]], truth: np.ndarray, frame: LocalFrame) -> np.ndarray:
    """Rows of true east and north, and the error along both, of images whose time has a true position."""
    stamps, latitude, longitude = (np.array([float(image[name]) for image in images])
                                   for name in ('stamp', 'latitude_deg', 'longitude_deg'))
    inside = (stamps >= truth[0, 0] - .01) & (stamps <= truth[-1, 0] + .01)
    true = np.column_stack([np.interp(stamps, truth[:, 0], truth[:, axis]) for axis in (1, 2)])
    return np.column_stack((true, frame.position(latitude, longitude) - true))[inside]


def figures(values: np.ndarray) -> str:
    return (f'mean {values.mean():.3f} m, 95 % {np.percentile(values, 95):.3f} m, 99 % '
            f'{np.percentile(values, 99):.3f} m, most {values.max():.3f} m')


def apart(errors: np.ndarray, before: np.ndarray) -> np.ndarray:
    """How far the same place is apart where both have an image."""
    distances = np.linalg.norm(errors[:, None, :2] - before[None, :, :2], axis=2)
    nearest = distances.argmin(axis=1)
    close = distances[np.arange(len(errors)), nearest] <= NEAR_M
    return np.linalg.norm(errors[close, 2:] - before[nearest[close], 2:], axis=1)


def errors_by_session(options: argparse.Namespace) -> Dict[str, np.ndarray]:
    """Of each session that has a bag, in the order of the maps."""
    images = [image for map_file in options.map for image in images_of(map_file, options.programs)]
    frame = LocalFrame(images[0])
    names = list(dict.fromkeys(image['session'] for image in images))
    bags = {bag.stem: bag for bag in options.bag}
    unknown = sorted(set(bags) - set(names))
    if unknown:
        raise ValueError(f"there is no session '{unknown[0]}', but {', '.join(names)}")
    return {name: errors_of([image for image in images if image['session'] == name],
                            truth_of(bags[name], options.truth_topic, frame), frame)
            for name in names if name in bags}


def report(sessions: Dict[str, np.ndarray]) -> None:
    before = np.empty((0, 4))
    for name, errors in sessions.items():
        print(f'{name}: {len(errors)} images, error {figures(np.linalg.norm(errors[:, 2:], axis=1))}')
        both = apart(errors, before) if len(before) else before
        if len(both):
            print(f'{name}: the same place as before at {len(both)} images, apart {figures(both)}')
        before = np.vstack((before, errors))


def plot(sessions: Dict[str, np.ndarray], path: Path, times: float) -> None:
    """Draws where the images lie, their errors enlarged."""
    axes = pyplot.figure(figsize=(6, 4), layout='constrained').add_subplot()
    for name, errors in sessions.items():
        shown = errors[:, :2] + times * errors[:, 2:]
        axes.plot(shown[:, 0], shown[:, 1], '.-', markersize=3, linewidth=.8, label=name)
    axes.set_aspect('equal')
    axes.set_xlabel('east, m')
    axes.set_ylabel('north, m')
    axes.set_title(f'images of the map, errors times {times:g}')
    axes.legend(frameon=False)
    pyplot.savefig(path, dpi=100)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split('\n', maxsplit=1)[0])
    parser.add_argument('--map', type=Path, action='append', required=True, help='map file; repeat it')
    parser.add_argument('--bag', type=Path, action='append', required=True, help='recording of a session; repeat it')
    parser.add_argument('--truth-topic', default='/ground_truth/fix', help='sensor_msgs/NavSatFix')
    parser.add_argument('--programs', type=Path, required=True, help='folder of map_info')
    parser.add_argument('--plot', type=Path, help='picture of where the images lie')
    parser.add_argument('--times', type=float, default=20, help='how much the plot enlarges errors')
    options = parser.parse_args()
    try:
        sessions = errors_by_session(options)
        report(sessions)
        if options.plot:
            plot(sessions, options.plot, options.times)
    except (OSError, ValueError, rosbag.ROSBagException, subprocess.CalledProcessError) as error:
        print(f'map_error.py: {error}', file=sys.stderr)
        return 1
    return 0


if __name__ == '__main__':
    sys.exit(main())
