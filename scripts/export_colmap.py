#!/usr/bin/python3
"""Writes cameras, poses, features and landmarks of a map as a text model of COLMAP (colmap.github.io/format.html).

A camera for each calibrated session, images with landmarks as SESSION/STAMP.png, landmarks as points, metres of the map
frame. COLMAP counts pixels from the corner of the image: everything is half a pixel farther than in the map. FOLDER is
new or empty. Needs numpy and OpenCV.
"""
import argparse
import os
import re
import sqlite3
import sys
import tempfile
from collections import defaultdict
from pathlib import Path
from typing import Dict, List, NamedTuple, Tuple

import cv2
import numpy as np

MAP_VERSION = 10
CORNER_PX = .5  # COLMAP's centre of the upper left pixel, in either axis
SHORT_INDICES = 65536  # up to this number of features an index has two bytes


class Camera(NamedTuple):
    width: int
    height: int
    parameters: List[float]  # fx, fy, cx, cy
    distortion: str
    coefficients: List[float]

    def line(self) -> str:
        """That of cameras.txt behind the number."""
        k = self.coefficients
        if self.distortion == 'equidistant':
            model, count = 'OPENCV_FISHEYE', 4
        elif not any(k):
            model, count = 'PINHOLE', 0
        else:
            model, count = ('FULL_OPENCV', 8) if any(k[4:]) else ('OPENCV', 4)
        fx, fy, cx, cy = self.parameters
        numbers = [fx, fy, cx + CORNER_PX, cy + CORNER_PX] + (k + [0.] * 8)[:count]
        return ' '.join([model, str(self.width), str(self.height), *map(repr, numbers)])

    def project(self, points: np.ndarray) -> np.ndarray:
        """Pixels of points (N x 3) in the frame of the camera."""
        fx, fy, cx, cy = self.parameters
        matrix = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])
        if self.distortion == 'equidistant':
            pixels = cv2.fisheye.projectPoints(points[:, None], np.zeros(3), np.zeros(3), matrix,
                                               np.array(self.coefficients))[0]
        else:
            pixels = cv2.projectPoints(points, np.zeros(3), np.zeros(3), matrix, np.array(self.coefficients))[0]
        return pixels.reshape(-1, 2)


class Session(NamedTuple):
    folder: str
    camera: Camera


def sessions_of(meta: Dict) -> List[Tuple[str, Camera]]:
    """Names without spaces, each once, and cameras; None without one."""
    sessions: List[Session] = []
    while (name := meta.get(f'session/{len(sessions)}')) is not None:
        key = f'session/{len(sessions)}/camera/'
        folder = re.sub(r'[^!-.0-~]', '_', name)
        if any(folder == other.folder for other in sessions):
            folder += f'_{len(sessions)}'
        camera = None
        if key + 'fx' in meta:
            count = sum(re.fullmatch(re.escape(key) + r'd\d+', other) is not None for other in meta)
            camera = Camera(meta[key + 'width'], meta[key + 'height'], [meta[key + k] for k in ('fx', 'fy', 'cx', 'cy')],
                            meta[key + 'distortion'], [meta[f'{key}d{k}'] for k in range(count)])
        sessions.append(Session(folder, camera))
    return sessions


def rotation_of(w: float, x: float, y: float, z: float) -> np.ndarray:
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])


class Model:
    """Gathers the three texts, image by image."""

    def __init__(self, meta: Dict):
        self.sessions = sessions_of(meta)
        self.cameras = [f'{s + 1} {session.camera.line()}' for s, session in enumerate(self.sessions) if session.camera]
        self.images: List[str] = []
        self.positions: Dict[int, np.ndarray] = {}
        self.tracks: Dict[int, List[str]] = defaultdict(list)
        self.errors_px: Dict[int, List[float]] = defaultdict(list)

    def add(self, number: int, session: int, stamp_ns: int, keypoints: bytes, pose: bytes, points: bytes) -> None:
        folder, camera = self.sessions[session]
        if camera is None:
            return
        pixels = np.frombuffer(keypoints, '<f4').reshape(-1, 4)[:, :2]
        index = '<u2' if len(pixels) <= SHORT_INDICES else '<u4'
        seen = np.frombuffer(points, [('feature', index), ('id', '<u4'), ('offset', '<f4', 3), ('sigmas', 'u1', 2)])
        numbers = np.frombuffer(pose, '<f8', 7)
        position, (w, *xyz) = numbers[:3], numbers[3:]
        to_camera = rotation_of(w, *xyz).T
        values = [w, *(-np.array(xyz)), *(-to_camera @ position)]
        self.images.append(f'{number + 1} ' + ' '.join(repr(float(value)) for value in values)
                           + f' {session + 1} {folder}/{stamp_ns // 10**9}.{stamp_ns % 10**9:09d}.png')
        ids = np.full(len(pixels), -1)
        ids[seen['feature']] = seen['id']
        self.images.append(' '.join(f'{x + CORNER_PX!r} {y + CORNER_PX!r} {i}'
                                    for (x, y), i in zip(pixels.astype(float).tolist(), ids)))
        for landmark in seen:
            self.positions.setdefault(int(landmark['id']), position + landmark['offset'])
            self.tracks[int(landmark['id'])].append(f'{number + 1} {landmark["feature"]}')
        if len(seen):
            in_camera = (np.array([self.positions[int(i)] for i in seen['id']]) - position) @ to_camera.T
            off = np.linalg.norm(camera.project(in_camera) - pixels[seen['feature']], axis=1)
            for i, error, ahead in zip(seen['id'], off, in_camera[:, 2] > 0):
                if ahead and np.isfinite(error):
                    self.errors_px[int(i)].append(float(error))

    def points(self) -> List[str]:
        return [' '.join([str(i), *(repr(float(value)) for value in self.positions[i]), '128 128 128',
                          repr(self.error(i)), *self.tracks[i]]) for i in sorted(self.positions)]

    def error(self, landmark: int) -> float:
        """Mean distance of the features from the projections; COLMAP's -1 where none is known."""
        return float(np.mean(self.errors_px[landmark])) if self.errors_px[landmark] else -1.

    def summary(self) -> str:
        known = [self.error(i) for i in self.positions if self.errors_px[i]]
        return (f'{len(self.cameras)} {"camera" if len(self.cameras) == 1 else "cameras"}, {len(self.images) // 2} images, '
                f'{len(self.positions)} points, {sum(map(len, self.tracks.values()))} observations, '
                f'mean reprojection error {np.mean(known) if known else -1:.6g} px')


def read(path: Path) -> Model:
    """Raises ValueError for what is not a map with landmarks, sqlite3.Error for what is not a database."""
    with open(path, 'rb'):
        pass  # for the system's own reason
    database = sqlite3.connect(f'{path.resolve().as_uri()}?mode=ro&immutable=1', uri=True)
    version, = database.execute('PRAGMA user_version').fetchone()
    if version != MAP_VERSION:
        raise ValueError(f'has map version {version}, but only version {MAP_VERSION} can be read; build it again')
    model = Model(dict(database.execute('SELECT key, value FROM meta')))
    for row in database.execute('SELECT images.id, session, stamp_ns, keypoints, pose, points FROM images '
                                'JOIN features ON features.image = images.id JOIN landmarks ON landmarks.image = images.id '
                                'ORDER BY images.id'):
        model.add(*row)
    if not model.positions:
        raise ValueError('not written as a COLMAP model: the map has no landmarks')
    return model


def write(model: Model, folder: Path) -> None:
    """All three files or none. Raises OSError."""
    with tempfile.TemporaryDirectory(prefix=f'.{folder.name}.', dir=folder.resolve().parent) as temporary:
        made = Path(temporary) / 'model'
        made.mkdir()
        for name, lines in (('cameras', model.cameras), ('images', model.images), ('points3D', model.points())):
            (made / f'{name}.txt').write_text('\n'.join(lines) + '\n', encoding='utf-8')
        os.rename(made, folder)  # refuses a folder with something in it


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[0])
    parser.add_argument('map', type=Path, help='map file')
    parser.add_argument('folder', type=Path, help='new or empty')
    args = parser.parse_args()
    try:
        model = read(args.map)
    except OSError as error:
        sys.exit(f'export_colmap: {args.map}: {error.strerror}')
    except (ValueError, KeyError, IndexError, sqlite3.Error) as error:
        sys.exit(f'export_colmap: {args.map}: {error}')
    try:
        write(model, args.folder)
    except OSError as error:
        sys.exit(f'export_colmap: {args.folder}: {error.strerror}')
    print(f'{args.folder}: {model.summary()}')
    return 0


if __name__ == '__main__':
    sys.exit(main())
