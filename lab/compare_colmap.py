#!/usr/bin/python3
"""Measures COLMAP beside the programs of this package: one recording makes the map, another one is localised in it.

COLMAP does it twice: with the handicap removed, on the poses of our map (point_triangulator), and all by itself, its
model laid onto the fixes of the recording (mapper, model_aligner). image_registrator then finds the drive's images.
Which training images to match each of them with, COLMAP is told from the true positions: without a trained vocabulary
tree it has no search for places. Needs COLMAP 3.8 and takes a quarter of an hour; `nice` it on a busy machine.
"""
import argparse
import csv
import math
import subprocess
import sys
from pathlib import Path
from typing import Dict

import cv2
import numpy as np
import rosbag
import package_scripts  # noqa: F401
from colmap_steps import Clock, Colmap, Poses, poses_of
from local_frame import LocalFrame

THRESHOLDS = ((0.25, 2.0), (0.5, 5.0), (5.0, 10.0))  # metres and degrees


class Recording:
    """A bag: its images as files that COLMAP reads, and what is known of them."""

    def __init__(self, bag: Path, options: argparse.Namespace):
        self.bag, self.name, self.options = bag, bag.stem, options
        self.stamps: Dict[str, float] = {}

    def extract(self, folder: Path) -> None:
        """Writes the images under the names that map_info gives them."""
        (folder / self.name).mkdir(parents=True, exist_ok=True)
        with rosbag.Bag(str(self.bag)) as bag:
            for _, message, _ in bag.read_messages([self.options.image_topic]):
                stamp = message.header.stamp
                name = f'{self.name}/{stamp.secs}.{stamp.nsecs:09d}.png'
                image = cv2.imdecode(np.frombuffer(message.data, np.uint8), cv2.IMREAD_GRAYSCALE)
                cv2.imwrite(str(folder / name), image)
                self.stamps[name] = stamp.to_sec()

    def fixes(self, topic: str) -> np.ndarray:
        """Rows of stamp, latitude, longitude, altitude; without those that are no fix."""
        with rosbag.Bag(str(self.bag)) as bag:
            rows = [(fix.header.stamp.to_sec(), fix.latitude, fix.longitude, fix.altitude)
                    for _, fix, _ in bag.read_messages([topic]) if fix.status.status >= 0]
        table = np.array(rows)
        return table[np.isfinite(table).all(axis=1)]

    def fix_positions(self, frame: LocalFrame) -> Dict[str, np.ndarray]:
        """East, north and height above the first fix, of the images that have fixes around them."""
        fixes = self.fixes(self.options.fix_topic)
        axes = [*frame.position(fixes[:, 1], fixes[:, 2]).T, fixes[:, 3] - fixes[0, 3]]
        return {name: np.array([np.interp(stamp, fixes[:, 0], axis) for axis in axes])
                for name, stamp in self.stamps.items() if np.min(abs(fixes[:, 0] - stamp)) <= 0.25}

    def true_poses(self, frame: LocalFrame, poses: Path) -> Poses:
        """By the exact fixes and the headings in `poses`."""
        fixes = self.fixes(self.options.truth_topic)
        places = frame.position(fixes[:, 1], fixes[:, 2])
        with open(poses, newline='', encoding='utf-8') as file:
            rows = [(int(row['stamp_ns']) * 1e-9, float(row['yaw_rad'])) for row in csv.DictReader(file)]
        headings = np.array(rows)
        truth = {}
        for name, stamp in self.stamps.items():
            fix, row = (int(np.argmin(abs(table[:, 0] - stamp))) for table in (fixes, headings))
            if max(abs(fixes[fix, 0] - stamp), abs(headings[row, 0] - stamp)) > 0.02:
                raise ValueError(f'{name}: no true pose')
            truth[name] = (*places[fix], headings[row, 1])
        return truth


def poses_of_track(track: Path, name: str) -> Poses:
    with open(track, newline='', encoding='utf-8') as file:
        return {f"{name}/{row['stamp']}.png": tuple(float(row[key]) for key in ('east_m', 'north_m', 'yaw_rad'))
                for row in csv.DictReader(file) if math.isfinite(float(row['east_m'] or 'nan'))}


def report(label: str, poses: Poses, truth: Poses, map_s: float, drive_s: float) -> str:
    found = [name for name in truth if name in poses]
    there, true = (np.array([table[name] for name in found]).reshape(-1, 3) for table in (poses, truth))
    error_m = np.hypot(*(there - true)[:, :2].T)
    turn_deg = abs(np.degrees(np.angle(np.exp(1j * (there - true)[:, 2]))))
    recall = [100 * np.sum((error_m <= metres) & (turn_deg <= degrees)) / len(truth) for metres, degrees in THRESHOLDS]
    if not found:
        return f'| {label} | {map_s:.0f} s | {drive_s:.0f} s | 0.0 % | – | – | 0.0 / 0.0 / 0.0 |'
    return (f'| {label} | {map_s:.0f} s | {drive_s:.0f} s | {100 * len(found) / len(truth):.1f} % | '
            f'{error_m.mean():.3f} / {np.percentile(error_m, 95):.2f} m | {turn_deg.mean():.2f}° | '
            + ' / '.join(f'{share:.1f}' for share in recall) + ' |')


def run_ours(options: argparse.Namespace, clock: Clock) -> None:
    """Map, model and track in the output folder; all training images are kept, as COLMAP keeps them."""
    camera = ('--camera-info', options.camera_info, '--image-topic', options.image_topic.replace('/compressed', ''))
    out, programs = options.output, options.programs
    clock.run('our map', programs / 'map_builder', '--bag', options.map_bag, *camera, '--fix-topic', options.fix_topic,
              '--output', out / 'ours.map', '--threads', options.threads, '--spacing', 0)
    clock.run('export', programs / 'map_info', out / 'ours.map', '--export-colmap', out / 'ours')
    clock.run('our drive', programs / 'localize', '--map', out / 'ours.map', '--bag', options.drive_bag, *camera,
              '--output', out / 'track.csv')


class Comparison:
    """COLMAP on the same recordings."""

    def __init__(self, options: argparse.Namespace, clock: Clock):
        self.options, self.clock = options, clock
        self.colmap = Colmap(options.colmap, options.output, options.threads, clock)
        self.mapped, self.driven = (Recording(bag, options) for bag in (options.map_bag, options.drive_bag))
        for recording in (self.mapped, self.driven):
            recording.extract(self.colmap.images)

    def judge_ours(self) -> None:
        """Also finds out the truth in the frame of our map."""
        track, spent = self.options.output / 'track.csv', self.clock.seconds
        with open(track, newline='', encoding='utf-8') as file:
            self.frame = LocalFrame(next(csv.DictReader(file)))
        self.truth = self.driven.true_poses(self.frame, self.options.drive_poses)
        self.places = self.mapped.true_poses(self.frame, self.options.map_poses)
        poses = poses_of_track(track, self.driven.name)
        print(report('this package', poses, self.truth, spent['our map'], spent['our drive']), flush=True)

    def find_features(self) -> None:
        """And the matches, for both models."""
        self.colmap.extract('map features', list(self.mapped.stamps), self.options.camera_info)
        self.colmap.match('map features', 'sequential_matcher')
        self.colmap.extract('drive features', list(self.driven.stamps), self.options.camera_info)
        self.colmap.match_near('drive features', self.places, self.truth, self.options.neighbours)

    def on_our_poses(self) -> Path:
        """A model with the poses of our map."""
        given = self.colmap.given(self.options.output / 'ours')
        return self.colmap.mapper('map, our poses', 'point_triangulator', self.options.output / 'triangulated',
                                  '--input_path', given, '--image_path', self.colmap.images)

    def by_itself(self) -> Path:
        """A model of its own, laid onto the fixes."""
        images = self.colmap.list_of(list(self.mapped.stamps))  # not those of the drive
        models = self.colmap.mapper('map, COLMAP', 'mapper', self.options.output / 'models', '--image_path',
                                    self.colmap.images, '--image_list_path', images)
        return self.colmap.align('map, COLMAP', self.colmap.largest(models), self.mapped.fix_positions(self.frame),
                                 self.options.align_error)

    def judge(self, label: str, model: Path, map_s: float) -> None:
        """Finds the images of the drive in a model."""
        found = self.colmap.mapper(label, 'image_registrator', model.with_name(model.name + '_drive'),
                                   '--input_path', model)
        poses = poses_of(self.colmap.text(found))
        training = [name for name in self.places if name in poses]
        error_m = [math.dist(poses[name][:2], self.places[name][:2]) for name in training]
        print(f'{label}: {len(training)} of {len(self.places)} training images, mean error {np.mean(error_m):.3f} m')
        spent = self.clock.seconds
        print(report(label, poses, self.truth, spent['map features'] + map_s, spent['drive features'] + spent[label]),
              flush=True)


def compare(options: argparse.Namespace) -> None:
    """Prints a row of the table after each method."""
    clock = Clock(options.output / 'log.txt', options.limit)
    comparison = Comparison(options, clock)
    run_ours(options, clock)
    print('| | map, processor | drive, processor | images with a pose | position: mean / 95 % | heading, mean | recall '
          '(0.25 m, 2°) / (0.5 m, 5°) / (5 m, 10°) |\n|' + '---|' * 7)
    comparison.judge_ours()
    comparison.find_features()
    model = comparison.on_our_poses()
    comparison.judge('COLMAP, our poses', model, clock.seconds['our map'] + clock.seconds['map, our poses'])
    model = comparison.by_itself()
    comparison.judge('COLMAP, its largest model', model, clock.seconds['map, COLMAP'])


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--map-bag', type=Path, required=True, help='recording that makes the map')
    parser.add_argument('--map-poses', type=Path, required=True, help='its true poses, CSV with stamp_ns and yaw_rad')
    parser.add_argument('--drive-bag', type=Path, required=True, help='recording to localise')
    parser.add_argument('--drive-poses', type=Path, required=True, help='its true poses')
    parser.add_argument('--camera-info', type=Path, required=True, help='calibration of both, YAML, plumb_bob')
    parser.add_argument('--output', type=Path, required=True, help='new folder for images, models and logs')
    parser.add_argument('--programs', type=Path, required=True, help='folder of map_builder, map_info and localize')
    parser.add_argument('--colmap', default='colmap', help='program (default: %(default)s)')
    parser.add_argument('--image-topic', default='/stereo/left/image_raw/compressed',
                        help='compressed images (default: %(default)s)')
    parser.add_argument('--fix-topic', default='/gps/fix', help='default: %(default)s')
    parser.add_argument('--truth-topic', default='/ground_truth/fix', help='true positions (default: %(default)s)')
    parser.add_argument('--neighbours', type=int, default=20,
                        help='training images that COLMAP matches with each image of the drive (default: %(default)s)')
    parser.add_argument('--align-error', type=float, default=1.0,
                        help='metres from its image up to which a fix counts for COLMAP (default: %(default)s)')
    parser.add_argument('--threads', type=int, default=2, help='of every program (default: %(default)s)')
    parser.add_argument('--limit', type=float, default=900.0, help='seconds for each step (default: %(default)s)')
    return parser.parse_args()


def main() -> int:
    """Exit code 1 when a program fails or takes too long; the rows before it are printed."""
    options = parse_arguments()
    try:
        options.output.mkdir()
        compare(options)
    except (subprocess.SubprocessError, OSError, ValueError) as error:
        print(f'compare_colmap.py: {error}', file=sys.stderr)
        return 1
    return 0


if __name__ == '__main__':
    sys.exit(main())
