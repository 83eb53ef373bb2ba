#!/usr/bin/python3
"""Counts TRACKING claims that are wrong, and what a claimed probability is worth.

CONFIG (YAML) names pairs of recordings, and how each is driven: in a map of the whole recording, in maps of its first
and last 60 %, without its middle third, of every third image; and in the whole map kidnapped or with a covered camera.
A claim is wrong when it is farther from the true position than `wrong` metres; in a map of another place every claim
is. Maps, recordings and tracks that are in OUTPUT already are used again. Writes claims.md, claims.csv (a row a drive)
and claims.svg there.
"""
import argparse
import concurrent.futures
import csv
import hashlib
import os
import subprocess
import sys
from pathlib import Path
from typing import Any, Callable, Dict, Iterator, List, NamedTuple, Optional, Tuple

import numpy as np
import rosbag
import yaml
from local_frame import fixes_of, metres_per_degree

PARTS: Dict[str, Callable[[int, int], bool]] = {  # the image, of how many
    'whole': lambda i, n: True,
    'first 60 %': lambda i, n: i < 0.6 * n,
    'last 60 %': lambda i, n: i >= 0.4 * n,
    'without a third': lambda i, n: not n / 3 <= i < 2 * n / 3,
    'every third': lambda i, n: i % 3 == 0}
MARGIN_S = 5.0  # fixes around the images of a part
COVERED = (0.5, 0.75)  # of the drive's images
BINS = (0.0, 0.5, 0.8, 0.9, 0.97, 0.99, 0.999, 1.0)
PAIR = {'name': None, 'map': None, 'drive': None, 'wrong': 10.0, 'starts': [0], 'cases': list(PARTS),
        'image_topic': '/stereo/left/image_raw', 'fix_topic': '/gps/fix', 'truth_topic': '/gps/fix',
        'camera_info': None, 'map_parameters': {}, 'elsewhere': False}
CASES = [*PARTS, 'kidnapped', 'covered']


class Claim(NamedTuple):
    """One image of a drive. error_m: infinite in a map of another place."""
    image: int
    state: str
    source: str
    probability: Optional[float]
    error_m: float


class Drive(NamedTuple):
    pair: str
    case: str
    start: int
    wrong_m: float
    images: List[Claim]

    def claims(self) -> List[Claim]:
        return [image for image in self.images if image.state == 'TRACKING']

    def wrong(self) -> List[Claim]:
        return [claim for claim in self.claims() if not claim.error_m <= self.wrong_m]


def fail(text: str) -> None:
    raise SystemExit(f'wrong_claims: {text}')


def read_config(path: Path, data: Path) -> List[Dict[str, Any]]:
    with open(path, encoding='utf-8') as file:
        pairs = yaml.safe_load(file)['pairs']
    for pair in pairs:
        unknown = set(pair) - set(PAIR)
        missing = {key for key in ('name', 'map', 'drive') if not pair.get(key)}
        if unknown or missing:
            fail(f'{path}: pair {pair.get("name")}: {"unknown" if unknown else "no"} {sorted(unknown or missing)}')
        if not set(pair.get('cases', [])) <= set(CASES):
            fail(f'{path}: pair {pair["name"]}: cases are {CASES}')
        for key in ('map', 'drive', 'camera_info'):
            if pair.get(key):
                pair[key] = data / pair[key]
                if not pair[key].exists():
                    fail(f'{pair[key]} does not exist')
    return [{**PAIR, **pair} for pair in pairs]


def copy(source: Path, target: Path, pair: Dict[str, Any], change: Callable[[int, int, Any], Any],
         ends: bool) -> None:
    """Copies a recording; change(image, of how many, message) gives the image's message, or None to leave it out.
    With `ends`, fixes only as far as the images that are left go."""
    topics = (pair['image_topic'], pair['image_topic'] + '/compressed')
    partial = target.with_suffix('.partial')
    with rosbag.Bag(str(source)) as bag, rosbag.Bag(str(partial), 'w') as out:
        stamps = [message.header.stamp.to_sec() for _, message, _ in bag.read_messages(topics)]
        kept = [stamp for i, stamp in enumerate(stamps) if change(i, len(stamps), None) is not False]
        begin, end = (min(kept) - MARGIN_S, max(kept) + MARGIN_S) if ends else (-np.inf, np.inf)
        image = 0
        for name, message, recorded in bag.read_messages():
            if name in topics:
                message = change(image, len(stamps), message)
                image += 1
                if message is not False:
                    out.write(name, message, recorded)
                continue
            stamp = message.header.stamp.to_sec() if hasattr(message, 'header') else recorded.to_sec()
            if begin <= stamp <= end or name.startswith('/tf'):
                out.write(name, message, recorded)
    partial.rename(target)


def covered(image: int, count: int, message: Any) -> Any:
    """The same image, black in a part of the drive."""
    if message is None or not COVERED[0] * count <= image < COVERED[1] * count:
        return message
    import cv2  # pylint: disable=import-outside-toplevel
    if hasattr(message, 'format'):
        black = np.zeros_like(cv2.imdecode(np.frombuffer(message.data, np.uint8), cv2.IMREAD_GRAYSCALE))
        message.data, message.format = cv2.imencode('.png', black)[1].tobytes(), 'mono8; png compressed'
    else:
        message.data = bytes(len(message.data))
    return message


def run(*command: object) -> None:
    result = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False)
    if result.returncode != 0:
        fail(f'{command[0]}: ' + (result.stderr or result.stdout).strip().splitlines()[-1])


def read_track(track: Path, truth: Optional[np.ndarray]) -> Iterator[Claim]:
    with open(track, newline='', encoding='utf-8') as file:
        for i, row in enumerate(csv.DictReader(file)):
            error_m = np.inf
            if truth is not None:
                east_m, north_m = metres_per_degree(float(truth[0, 1]))
                latitude, longitude = truth[np.argmin(np.abs(truth[:, 0] - float(row['stamp'])))][1:]
                error_m = float(np.hypot((float(row['longitude_deg']) - longitude) * east_m,
                                         (float(row['latitude_deg']) - latitude) * north_m))
            probability = float(row['probability']) if row.get('probability') else None
            yield Claim(i, row['state'], row['source'], probability, error_m)


class Runner:
    def __init__(self, programs: Path, output: Path) -> None:
        self.programs, self.output = programs, output

    def stem(self, pair: Dict[str, Any], case: str) -> Path:
        """Of a drive's files."""
        return self.output / f'{pair["name"]}_{case}'.replace(' %', '').replace(' ', '_')

    def map_path(self, pair: Dict[str, Any], case: str) -> Path:
        """Of what is built of one recording in one way, whoever drives in it."""
        way = repr((pair['map'], pair['fix_topic'], pair['map_parameters'], self.common(pair)))
        part = (case if case in PARTS else 'whole').replace(' %', '').replace(' ', '_')
        return self.output / f'{pair["map"].stem}_{part}_{hashlib.sha256(way.encode()).hexdigest()[:8]}.map'

    def build_map(self, pair: Dict[str, Any], case: str) -> None:
        built = self.map_path(pair, case)
        if built.exists():
            return
        bag, parameters = pair['map'], built.with_suffix('.yaml')
        keeps = PARTS.get(case, PARTS['whole'])
        if keeps is not PARTS['whole']:
            bag = built.with_suffix('.bag')
            copy(pair['map'], bag, pair, lambda i, n, message: message if keeps(i, n) else False, ends=True)
        text = yaml.safe_dump(pair['map_parameters']) if pair['map_parameters'] else ''
        parameters.write_text(text, encoding='utf-8')
        run(self.programs / 'map_builder', '--bag', bag, '--fix-topic', pair['fix_topic'], '--output', built,
            '--config', parameters, *self.common(pair))

    @staticmethod
    def common(pair: Dict[str, Any]) -> List[object]:
        camera = ['--camera-info', pair['camera_info']] if pair['camera_info'] else []
        return ['--image-topic', pair['image_topic'], *camera]

    def drive(self, pair: Dict[str, Any], case: str, start: int) -> Drive:
        stem = self.stem(pair, case)
        track = stem.with_name(f'{stem.name}_{start}.csv')
        bag = pair['drive']
        if case == 'covered':
            bag = stem.with_suffix('.bag')
        if not track.exists():
            extra: List[object] = []
            if case == 'kidnapped':
                with rosbag.Bag(str(pair['drive'])) as drive:
                    topics = drive.get_type_and_topic_info().topics
                count = max(topics[t].message_count for t in (pair['image_topic'], pair['image_topic'] + '/compressed')
                            if t in topics)
                extra = ['--kidnap-at', (start + count // 4) % count, '--kidnap-to', (start + count * 3 // 4) % count]
            run(self.programs / 'localize', '--map', self.map_path(pair, case), '--bag', bag,
                '--seed', 1, '--start-index', start, '--output', track, *self.common(pair), *extra)
        truth = None if pair['elsewhere'] else fixes_of(pair['drive'], pair['truth_topic'])
        return Drive(pair['name'], case, start, pair['wrong'], list(read_track(track, truth)))

    def cover(self, pair: Dict[str, Any]) -> None:
        bag = self.stem(pair, 'covered').with_suffix('.bag')
        if not bag.exists():
            copy(pair['drive'], bag, pair, covered, ends=False)

    def all_drives(self, pairs: List[Dict[str, Any]], jobs: int) -> List[Drive]:
        tasks = [(pair, case, start) for pair in pairs for case in pair['cases'] for start in pair['starts']]
        with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
            maps = {self.map_path(pair, case): (pair, case) for pair, case, _ in tasks}
            list(pool.map(lambda task: self.build_map(*task), maps.values()))
            list(pool.map(self.cover, [pair for pair in pairs if 'covered' in pair['cases']]))
            return list(pool.map(lambda task: self.drive(*task), tasks))


def row_of(drives: List[Drive]) -> Tuple[int, int, int, str]:
    """Images, claims, wrong ones, and the worst of them."""
    wrong = [(claim.error_m, drive, claim) for drive in drives for claim in drive.wrong()]
    worst = ''
    if wrong:
        error_m, drive, claim = max(wrong, key=lambda one: one[0])
        far = f'{error_m:.0f} m' if np.isfinite(error_m) else 'elsewhere'
        worst = f'{far}: image {claim.image} from {drive.start}'
    return sum(len(d.images) for d in drives), sum(len(d.claims()) for d in drives), len(wrong), worst


def reliability(drives: List[Drive]) -> List[Tuple[float, float, int, float, float]]:
    """By claimed probability: from, to, images, mean claimed, share that is right."""
    points = np.array([(image.probability, image.error_m <= drive.wrong_m) for drive in drives
                       for image in drive.images if image.probability is not None], dtype=float).reshape(-1, 2)
    rows = []
    for low, high in zip(BINS, BINS[1:]):
        inside = points[(points[:, 0] >= low) & ((points[:, 0] < high) | (high == 1.0))]
        if len(inside):
            rows.append((low, high, len(inside), float(inside[:, 0].mean()), float(inside[:, 1].mean())))
    return rows


def write_tables(drives: List[Drive], output: Path) -> str:
    lines = ['| pair | case | images | `TRACKING` | wrong | worst |', '|---|---|---|---|---|---|']
    for pair, case in dict.fromkeys((drive.pair, drive.case) for drive in drives):
        images, claims, wrong, worst = row_of([d for d in drives if (d.pair, d.case) == (pair, case)])
        lines.append(f'| {pair} | {case} | {images} | {claims} | {wrong} | {worst} |')
    images, claims, wrong, worst = row_of(drives)
    lines.append(f'| **all** | | {images} | {claims} | **{wrong}** | {worst} |')
    lines += ['', '| `TRACKING` by source | claims | wrong |', '|---|---|---|']
    for source in ('METRIC', 'PLACE', 'NONE'):
        of = [sum(claim.source == source for drive in drives for claim in select(drive))
              for select in (Drive.claims, Drive.wrong)]
        lines.append(f'| {source} | {of[0]} | {of[1]} |')
    lines += ['', '| claimed probability | images | mean | right |', '|---|---|---|---|']
    lines += [f'| {low:g} to {high:g} | {count} | {mean:.3f} | {right:.3f} |'
              for low, high, count, mean, right in reliability(drives)]
    text = '\n'.join(lines) + '\n'
    (output / 'claims.md').write_text(text, encoding='utf-8')
    with open(output / 'claims.csv', 'w', newline='', encoding='utf-8') as file:
        writer = csv.writer(file)
        writer.writerow(['pair', 'case', 'start', 'images', 'claims', 'wrong', 'worst_m'])
        for drive in drives:
            worst_m = max((claim.error_m for claim in drive.claims()), default=np.nan)
            writer.writerow([drive.pair, drive.case, drive.start, len(drive.images), len(drive.claims()),
                             len(drive.wrong()), f'{worst_m:.2f}'])
    return text


def draw(drives: List[Drive], path: Path) -> None:
    import matplotlib  # pylint: disable=import-outside-toplevel
    matplotlib.use('Agg')
    from matplotlib import pyplot  # pylint: disable=import-outside-toplevel
    figure, axes = pyplot.subplots(figsize=(4.5, 4.0))
    axes.plot([0, 1], [0, 1], color='0.7', linewidth=1)
    rows = reliability(drives)
    axes.plot([row[3] for row in rows], [row[4] for row in rows], 'o-', color='#0072B2')
    for _, _, count, mean, right in rows:
        axes.annotate(str(count), (mean, right), textcoords='offset points', xytext=(-6, 6), ha='right', fontsize=7)
    axes.set_xlabel('claimed probability around the published position')
    axes.set_ylabel('share that is right')
    figure.tight_layout()
    figure.savefig(path)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('config', type=Path, help='pairs of recordings, config/claims.yaml')
    parser.add_argument('output', type=Path, help='folder for maps, tracks and tables')
    parser.add_argument('--data', type=Path, default=Path(os.environ.get('VISUAL_LOCALIZATION_DATA', '.')),
                        help='folder of the recordings (default: VISUAL_LOCALIZATION_DATA)')
    parser.add_argument('--only', nargs='+', help='names of pairs')
    parser.add_argument('--programs', type=Path, default=Path('build/test/devel/lib/visual_localization'))
    parser.add_argument('--jobs', type=int, default=os.cpu_count() or 1, help='drives at a time (default: %(default)s)')
    args = parser.parse_args()
    pairs = [pair for pair in read_config(args.config, args.data) if not args.only or pair['name'] in args.only]
    if not pairs:
        fail(f'{args.config} has no such pair')
    args.output.mkdir(parents=True, exist_ok=True)
    drives = Runner(args.programs, args.output).all_drives(pairs, args.jobs)
    print(write_tables(drives, args.output), end='')
    draw(drives, args.output / 'claims.svg')


if __name__ == '__main__':
    sys.exit(main())
