"""No input makes a program take more resident memory than doc/faults.md says: hostile inputs, and what each took."""
import itertools
import resource
import subprocess
import sys
import threading
import time
import unittest
import warnings
from pathlib import Path

import cv2
import numpy as np

warnings.filterwarnings('ignore', category=DeprecationWarning)
import genpy  # noqa: E402
import rosbag  # noqa: E402
from sensor_msgs.msg import CompressedImage, NavSatFix  # noqa: E402

from program_runner import PROGRAMS, ProgramTest  # noqa: E402

sys.path.append(str(Path(__file__).resolve().parent.parent / 'support'))
from memory_bounds import (builder_bound, editor_bound, evaluate_bound, localizer_bound, merge_bound,  # noqa: E402
                           mib, peak_mib, with_size)

MAP, DRIVE, CORPUS = (Path(argument) for argument in sys.argv[2:5])
MAP_IMAGES, DRIVE_IMAGES = 450, 450  # at most
IMAGES, FIXES = '/stereo/left/image_raw/compressed', '/gps/fix'
THREADS = 2


class Run:
    """A program and the most resident memory that it has."""

    def __init__(self, program: str, *arguments):
        self.peak_mib = 0.0
        with subprocess.Popen([str(PROGRAMS / program), *map(str, arguments)], stdout=subprocess.DEVNULL,
                              stderr=subprocess.PIPE, text=True) as process:
            watch = threading.Thread(target=self.watch, args=(process,))
            watch.start()
            try:
                _, self.stderr = process.communicate(timeout=200)
            finally:
                process.kill()
                watch.join()
        self.code = process.returncode

    def watch(self, process):
        while process.poll() is None:
            self.peak_mib = max(self.peak_mib, peak_mib(process.pid))
            time.sleep(0.005)


def at(seconds: float) -> genpy.Time:
    return genpy.Time.from_sec(1_000_000_000 + seconds)


def write_bag(path: Path, images: list, fixes: int, fix_period_s: float = 0.1):
    """`images`: encoded, one a second."""
    with rosbag.Bag(str(path), 'w') as bag:
        for k in range(fixes):
            fix = NavSatFix(latitude=48.5 + 1e-6 * k * (fix_period_s / 0.1), longitude=9.0, altitude=340.0)
            fix.header.stamp = at(fix_period_s * k)
            bag.write(FIXES, fix, fix.header.stamp)
        for k, data in enumerate(images):
            message = CompressedImage(format='jpeg', data=data)
            message.header.stamp = at(k)
            bag.write(IMAGES, message, message.header.stamp)


def encoded(side: int, seed: int, extension: str = '.jpg') -> bytes:
    pixels = np.random.default_rng(seed).integers(0, 256, (side * 3 // 4, side), dtype=np.uint8)
    return cv2.imencode(extension, pixels)[1].tobytes()


class MemoryTest(ProgramTest):
    """Hostile inputs and what they may take."""

    def check(self, name: str, bound_mib: float, *command, codes=(0, 1)):
        run = Run(*command)
        print(f'{command[0]:12} {name:44} bound {bound_mib:6.0f} MiB, took {run.peak_mib:6.0f} MiB, exit {run.code}',
              flush=True)
        self.assertIn(run.code, codes, f'{name}: {run.stderr}')
        self.assertNotIn('memory', run.stderr, name)
        self.assertLessEqual(run.peak_mib, bound_mib, name)

    def build(self, name: str, images: list, used_pixels: int, fixes: int, fix_period_s: float = 0.1):
        bag = self.folder / 'round.bag'
        write_bag(bag, images, fixes, fix_period_s)
        bound = builder_bound(THREADS, used_pixels, len(images), fixes)
        self.check(name, bound, 'map_builder', '--bag', bag, '--threads', THREADS, '--output', self.folder / 'round.map')
        self.check(name, localizer_bound(320 * 240, mib(MAP.stat().st_size)), 'localize', '--map', MAP, '--bag', bag,
                   '--output', self.folder / 'track.csv')

    def test_dense_noise(self):
        self.build('noise of 1600 x 1200', [encoded(1600, k) for k in range(6)], 1600 * 1200, 60)

    def test_a_few_huge_images_among_small_ones(self):
        huge = encoded(4096, 0)
        self.build('four of 4096 x 3072 before 30 of 320 x 240',
                   4 * [huge] + [encoded(320, k) for k in range(30)], 320 * 240, 340)

    def test_images_that_claim_to_be_huge(self):
        small = [encoded(320, k) for k in range(20)]
        bombs = [with_size(jpeg, 60000) for jpeg in small] + [with_size(jpeg, 4096) for jpeg in small]
        self.build('JPEGs that claim 60000 and 4096 pixels a side', bombs + small, 320 * 240, 600)

    def test_a_picture_that_compresses_well(self):
        white = cv2.imencode('.png', np.full((2560, 2560), 255, np.uint8))[1].tobytes()
        self.build('white PNGs of 2560 x 2560', 4 * [white], 2560 * 2560, 40)

    def test_many_fixes_at_once(self):
        self.build('50 000 fixes, 1 us apart', [encoded(320, k) for k in range(6)], 320 * 240, 50_000, 1e-6)

    def test_bags_with_wrong_lengths(self):
        whole = DRIVE.read_bytes()
        bag = self.folder / 'wrong.bag'
        places = itertools.chain(range(13, 60, 9), range(4131, 4400, 62), range(len(whole) - 900, len(whole) - 8, 401))
        bound = builder_bound(THREADS, 320 * 240, 450, 2500)
        for place in places:
            bag.write_bytes(whole[:place] + b'\xf0\xff\xff\x7f' + whole[place + 4:])
            self.check(f'a bag with a length of 2 GiB at {place}', bound, 'map_builder', '--bag', bag, '--threads',
                       THREADS, '--output', self.folder / 'wrong.map')

    def test_maps_of_others(self):
        whole = MAP.read_bytes()
        wrong = self.folder / 'wrong.map'
        cases = {path.name: path.read_bytes() for path in sorted(CORPUS.rglob('*.map'))}
        for place in range(20, len(whole) - 8, len(whole) // 8):
            cases[f'a map overwritten at {place}'] = whole[:place] + 64 * b'\xff' + whole[place + 64:]
        cache = mib(len(whole))
        for name, content in cases.items():
            wrong.write_bytes(content)
            self.check(name, editor_bound(cache), 'map_info', wrong, '--check')
            self.check(name, localizer_bound(320 * 240, cache), 'localize', '--map', wrong, '--bag', DRIVE, '--output',
                       self.folder / 'track.csv')
            self.check(name, editor_bound(cache), 'map_edit', 'thin', '--map', wrong, '--spacing', 5, '--output',
                       self.folder / 'thin.map')

    def evaluate(self, name: str, bag: Path, starts: str, bound_mib: float):
        experiment = self.folder / 'experiment.yaml'
        experiment.write_text(f'''experiment: memory
title: "Memory"
source: "a test"
rounds:
  image_topic: /stereo/left/image_raw
  fix_topic: {FIXES}
  bags:
    - {{name: one, bag: {bag}, group: one}}
    - {{name: two, bag: {bag}, group: two}}
pairs:
  - [one, two]
starts: {starts}
methods:
  - {{name: DPSO-80, tracker: dpso}}
''', encoding='utf-8')
        self.check(name, bound_mib, 'evaluate', '--config', experiment, '--threads', THREADS, '--output',
                   self.folder / 'results', codes=(0,))

    def test_evaluation_of_dense_noise(self):
        bag = self.folder / 'noise.bag'
        write_bag(bag, [encoded(1600, k) for k in range(6)], 60)
        self.evaluate('noise of 1600 x 1200', bag, 'all', evaluate_bound(THREADS, 1600 * 1200, 6, 6, 6))

    def test_evaluation_from_every_image(self):
        bound = evaluate_bound(THREADS, 320 * 240, MAP_IMAGES, DRIVE_IMAGES, DRIVE_IMAGES)
        self.evaluate('a run from every image', DRIVE, 'all', bound)

    def test_merging(self):
        other, merged = self.folder / 'other.map', self.folder / 'merged.map'
        self.check('a recording', builder_bound(THREADS, 320 * 240, DRIVE_IMAGES, 2500), 'map_builder', '--bag', DRIVE,
                   '--threads', THREADS, '--output', other, codes=(0,))
        for name, path in [('a map of another day', other)] + [(path.name, path) for path in CORPUS.rglob('*.map')]:
            sizes = mib(MAP.stat().st_size + path.stat().st_size)
            self.check(name, merge_bound(THREADS, sizes, MAP_IMAGES + DRIVE_IMAGES), 'map_edit', 'merge', MAP, path,
                       '--threads', THREADS, '--output', merged, codes=(0,) if path == other else (0, 1))

    def test_programs_end_when_memory_is_refused(self):
        """Also with the threads of a BLAS, which wait for memory without end. The loader's refusals count as well."""
        small = next(path for path in sorted(CORPUS.rglob('*.map')) if path.parent.name == 'accepted')
        for limit_mib in range(200, 440, 10):
            limit = limit_mib * 2 ** 20
            command = [PROGRAMS / 'map_edit', 'thin', '--map', small, '--spacing', 1, '--output', self.folder / 'o.map']
            result = subprocess.run(list(map(str, command)), capture_output=True, timeout=60, check=False,
                                    preexec_fn=lambda most=limit: resource.setrlimit(resource.RLIMIT_AS, (most, most)))
            if result.returncode == 1:
                self.assertIn(b'memory', result.stderr, limit_mib)

    def test_texts_without_end(self):
        texts = {'aliases of aliases': 'a: &a [1,1,1,1,1,1,1,1,1]\n' + ''.join(
            f'{chr(98 + k)}: &{chr(98 + k)} [{",".join(9 * ["*" + chr(97 + k)])}]\n' for k in range(12)),
            'depth': 100_000 * '[', 'a long key': 1_000_000 * 'k' + ': 1\n'}
        config = self.folder / 'config.yaml'
        polygon = self.folder / 'polygon.json'
        usage = self.folder / 'usage.csv'
        usage.write_text('stamp_ns,poses,landmarks\n' + 200_000 * '1,1,' + '\n')
        for name, text in texts.items():
            config.write_text(text)
            polygon.write_text(text)
            output = self.folder / 'out.map'
            self.check(name, localizer_bound(320 * 240, mib(MAP.stat().st_size)), 'localize', '--map', MAP, '--bag',
                       DRIVE, '--config', config, '--output', self.folder / 'track.csv')
            self.check(name, editor_bound(mib(MAP.stat().st_size)), 'map_edit', 'cut', '--map', MAP, '--polygon',
                       polygon, '--output', output)
        self.check('a usage of one line', editor_bound(mib(MAP.stat().st_size)), 'map_edit', 'summarise', '--map', MAP,
                   '--usage', usage, '--output', self.folder / 'out.map')


if __name__ == '__main__':
    unittest.main(argv=sys.argv[:1])
