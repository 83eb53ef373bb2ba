"""COLMAP's programs and model files, for compare_colmap.py."""
import math
import resource
import sqlite3
import subprocess
import time
from pathlib import Path
from typing import Dict, List, Tuple

import numpy as np
import package_scripts  # noqa: F401
from camera_info import read_camera_info

Poses = Dict[str, Tuple[float, float, float]]  # east, north, yaw by the name of the image


class Clock:
    """Runs the steps of a pipeline, one program after the other, and adds up their processor time."""

    def __init__(self, log: Path, limit_s: float):
        self.log, self.limit_s, self.seconds = log, limit_s, {}

    def run(self, pipeline: str, *command) -> None:
        """Ends with a message when the program fails or takes too long."""
        words = [str(word) for word in command]
        begin, begin_s = time.monotonic(), self._used_s()
        with open(self.log, 'a', encoding='utf-8') as log:
            subprocess.run(words, stdout=log, stderr=log, timeout=self.limit_s, check=True)
        used_s = self._used_s() - begin_s
        self.seconds[pipeline] = self.seconds.get(pipeline, 0.0) + used_s
        print(f'{pipeline}: {Path(words[0]).name} {words[1]}: {time.monotonic() - begin:.1f} s, '
              f'processor {used_s:.1f} s', flush=True)

    @staticmethod
    def _used_s() -> float:
        used = resource.getrusage(resource.RUSAGE_CHILDREN)
        return used.ru_utime + used.ru_stime


def read_images(model: Path) -> Dict[str, Tuple[np.ndarray, np.ndarray]]:
    """Rotation world to camera, and translation, of each image of a text model."""
    with open(model / 'images.txt', encoding='utf-8') as file:
        lines = [line for line in file if not line.startswith('#')]
    images = {}
    for line in lines[::2]:
        words = line.split()
        w, x, y, z = (float(word) for word in words[1:5])
        rotation = np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                             [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                             [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])
        images[words[9]] = (rotation, np.array([float(word) for word in words[5:8]]))
    return images


def poses_of(model: Path) -> Poses:
    poses = {}
    for name, (rotation, translation) in read_images(model).items():
        place, view = -rotation.T @ translation, rotation[2]
        poses[name] = (place[0], place[1], math.atan2(view[1], view[0]))
    return poses


class Colmap:
    """COLMAP's database and models of a comparison."""

    def __init__(self, program: str, output: Path, threads: int, clock: Clock):
        self.program, self.output, self.threads, self.clock = program, output, threads, clock
        self.database, self.images = output / 'database.db', output / 'images'

    def run(self, pipeline: str, step: str, *arguments) -> None:
        """One of COLMAP's commands."""
        self.clock.run(pipeline, self.program, step, *arguments)

    def extract(self, pipeline: str, images: List[str], calibration: Path) -> None:
        """Features of a recording, whose camera is known."""
        info = read_camera_info(calibration)
        if info.distortion_model != 'plumb_bob' or any(info.D[4:]):
            raise ValueError(f'{calibration}: only plumb_bob without k3')
        values = [info.K[0], info.K[4], info.K[2] + 0.5, info.K[5] + 0.5, *info.D[:4]]
        self.run(pipeline, 'feature_extractor', '--database_path', self.database, '--image_path', self.images,
                 '--image_list_path', self.list_of(images), '--ImageReader.single_camera', 1,
                 '--ImageReader.camera_model', 'OPENCV', '--ImageReader.camera_params', ','.join(map(str, values)),
                 '--SiftExtraction.use_gpu', 0, '--SiftExtraction.num_threads', self.threads)

    def list_of(self, images: List[str]) -> Path:
        path = self.output / 'images.txt'
        path.write_text('\n'.join(images) + '\n', encoding='utf-8')
        return path

    def match(self, pipeline: str, matcher: str, *arguments) -> None:
        """Without a graphics card."""
        self.run(pipeline, matcher, '--database_path', self.database, '--SiftMatching.use_gpu', 0,
                 '--SiftMatching.num_threads', self.threads, *arguments)

    def mapper(self, pipeline: str, step: str, target: Path, *arguments) -> Path:
        """Makes or extends a model; the calibration stays as it is."""
        target.mkdir()
        arguments = ['--database_path', self.database, '--output_path', target, *arguments]
        for name in ('focal_length', 'principal_point', 'extra_params'):
            arguments += [f'--Mapper.ba_refine_{name}', 0]
        self.run(pipeline, step, *arguments, '--Mapper.num_threads', self.threads)
        return target

    def text(self, model: Path) -> Path:
        """The same model as text, beside it; not timed."""
        target = model.with_name(model.name + '_text')
        target.mkdir()
        subprocess.run([self.program, 'model_converter', '--input_path', model, '--output_path', target,
                        '--output_type', 'TXT'], stdout=subprocess.DEVNULL, check=True)
        return target

    def largest(self, models: Path) -> Path:
        """Of the models that the mapper made the one with most images."""
        return max(sorted(models.iterdir()), key=lambda model: len(read_images(self.text(model))))

    def given(self, poses: Path) -> Path:
        """A model without points: the poses of our map, under the numbers of the images in the database."""
        target = self.output / 'given'
        target.mkdir()
        with sqlite3.connect(self.database) as database:
            numbers = dict(database.execute('SELECT name, image_id FROM images'))
        lines = [line.split() for line in (poses / 'images.txt').read_text(encoding='utf-8').splitlines()[::2]]
        images = ''.join(f"{numbers[line[9]]} {' '.join(line[1:])}\n\n" for line in lines)
        for name, text in (('cameras.txt', (poses / 'cameras.txt').read_text(encoding='utf-8')),
                           ('images.txt', images), ('points3D.txt', '')):
            (target / name).write_text(text, encoding='utf-8')
        return target

    def align(self, pipeline: str, model: Path, positions: Dict[str, np.ndarray], error_m: float) -> Path:
        """Lays a model onto positions: one place, direction and scale for all of it."""
        target, names = self.output / 'aligned', self.output / 'positions.txt'
        target.mkdir()
        lines = [' '.join([name, *map(str, position)]) + '\n' for name, position in positions.items()]
        names.write_text(''.join(lines), encoding='utf-8')
        self.run(pipeline, 'model_aligner', '--input_path', model, '--output_path', target, '--ref_images_path', names,
                 '--ref_is_gps', 0, '--robust_alignment_max_error', error_m)
        return target

    def match_near(self, pipeline: str, mapped: Poses, driven: Poses, neighbours: int) -> None:
        """Each image of the drive with the training images nearest to it."""
        names, places = list(mapped), np.array([pose[:2] for pose in mapped.values()])
        lines = []
        for drive, pose in driven.items():
            nearest = np.argsort(np.hypot(*(places - np.array(pose[:2])).T))[:neighbours]
            lines += [f'{drive} {names[k]}\n' for k in nearest]
        path = self.output / 'pairs.txt'
        path.write_text(''.join(lines), encoding='utf-8')
        self.match(pipeline, 'matches_importer', '--match_list_path', path)
