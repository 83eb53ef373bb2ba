"""export_colmap.py on a made-up map: cameras, images and points of the model, and what is refused."""
import sqlite3
import struct
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import numpy as np

sys.path.insert(0, sys.argv[1])
from export_colmap import Camera  # noqa: E402

SCRIPT = Path(sys.argv[1]) / 'export_colmap.py'
OFF_PX = (.5, -.25, 1., 0.)  # of a feature from its landmark's projection, by image
LANDMARKS = np.array([[12., 2., 3.], [15., -3., .5]])
LOOKS_EAST = (.5, -.5, .5, -.5)  # w, x, y, z: the camera's z is east, its x south
AXES = np.array([[0, 0, 1], [-1, 0, 0], [0, -1, 0]])
CAMERA = {'width': 320, 'height': 240, 'fx': 266.25, 'fy': 266.5, 'cx': 159.5, 'cy': 119.25, 'distortion': 'plumb_bob',
          'd0': -.125, 'd1': .0625, 'd2': .01, 'd3': -.02}
TABLES = ('meta(key TEXT PRIMARY KEY, value)', 'images(id INTEGER PRIMARY KEY, session, stamp_ns)',
          'features(image INTEGER PRIMARY KEY, keypoints)', 'landmarks(image INTEGER PRIMARY KEY, pose, points)')


def projected(point: np.ndarray) -> np.ndarray:
    """By COLMAP's model OPENCV, from the frame of the camera."""
    k1, k2, p1, p2 = (CAMERA[f'd{i}'] for i in range(4))
    x, y = point[:2] / point[2]
    r2 = x * x + y * y
    radial = 1 + k1 * r2 + k2 * r2 * r2
    return np.array([CAMERA['fx'] * (x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)) + CAMERA['cx'],
                     CAMERA['fy'] * (y * radial + 2 * p2 * x * y + p1 * (r2 + 2 * y * y)) + CAMERA['cy']])


class ExportColmapTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        self.map, self.model = self.folder / 'made.map', self.folder / 'model'

    def make(self, landmarks: bool = True, version: int = 10) -> None:
        """Five images of a drive to the east; each of the first four shows two landmarks and a feature that is none."""
        with sqlite3.connect(self.map) as database:
            for table in TABLES:
                database.execute(f'CREATE TABLE {table}')
            database.execute(f'PRAGMA user_version = {version}')
            for s, name in enumerate(('mon day/1', 'mon_day_1')):
                values = {f'session/{s}': name, **{f'session/{s}/camera/{key}': value for key, value in CAMERA.items()}}
                database.executemany('INSERT INTO meta VALUES (?, ?)', values.items())
            for i in range(5):
                position = np.array([i, .1, 1.])
                pixels = [(10. + i, 20.)]
                if i < 4:
                    pixels += [projected(AXES.T @ (point - position)) + (OFF_PX[i], 0) for point in LANDMARKS]
                keypoints = b''.join(struct.pack('<4f', x, y, 3, 0) for x, y in pixels)
                database.execute('INSERT INTO images VALUES (?, ?, ?)', (i, int(i >= 2), (i + 1) * 10**9 + 7))
                database.execute('INSERT INTO features VALUES (?, ?)', (i, keypoints))
                if i == 4 or not landmarks:
                    continue
                seen = b''.join(struct.pack('<HI3f2B', k + 1, 40 + k, *(point - position), 9, 9)
                                for k, point in enumerate(LANDMARKS))
                pose = struct.pack('<7d', *position, *LOOKS_EAST) + bytes(84)
                database.execute('INSERT INTO landmarks VALUES (?, ?, ?)', (i, pose, seen))
        database.close()

    def run_script(self) -> subprocess.CompletedProcess:
        return subprocess.run([sys.executable, str(SCRIPT), str(self.map), str(self.model)], capture_output=True, text=True,
                              timeout=100, check=False)

    def export(self) -> dict:
        """The words of each line, by file."""
        done = self.run_script()
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn('2 cameras, 4 images, 2 points, 8 observations, mean reprojection error 0.4375', done.stdout)
        return {path.stem: [line.split() for line in path.read_text(encoding='utf-8').splitlines()]
                for path in self.model.iterdir()}

    def assert_refused(self, *words: str) -> None:
        done = self.run_script()
        self.assertEqual((done.returncode, len(done.stderr.splitlines())), (1, 1), done.stderr)
        for word in words:
            self.assertIn(word, done.stderr)

    def test_points_project_onto_their_features(self):
        self.make()
        texts = self.export()
        self.assertEqual(texts['cameras'][0], '1 OPENCV 320 240 266.25 266.5 160.0 119.75 -0.125 0.0625 0.01 -0.02'.split())
        for number, point in zip((40, 41), texts['points3D']):
            self.assertEqual(point[0], str(number))
            self.assertAlmostEqual(float(point[7]), np.mean(np.abs(OFF_PX)), delta=1e-4)
            self.assertEqual(point[8:], f'1 {number - 39} 2 {number - 39} 3 {number - 39} 4 {number - 39}'.split())
            at = np.array(list(map(float, point[1:4])))
            for k in range(4):
                pose, features = texts['images'][2 * k:2 * k + 2]
                w, x, y, z = map(float, pose[1:5])
                vector = np.array([x, y, z])
                turned = at + 2 * np.cross(vector, np.cross(vector, at) + w * at)
                seen = projected(turned + list(map(float, pose[5:8]))) + .5
                feature = features[3 * (number - 39):][:3]
                self.assertAlmostEqual(float(feature[0]) - seen[0], OFF_PX[k], delta=1e-3)
                self.assertAlmostEqual(float(feature[1]), seen[1], delta=1e-3)
                self.assertEqual(feature[2], str(number))

    def test_images_have_names_without_spaces_and_all_their_features(self):
        self.make()
        images = self.export()['images']
        self.assertEqual([line[-1] for line in images[::2]],
                         ['mon_day_1/1.000000007.png', 'mon_day_1/2.000000007.png', 'mon_day_1_1/3.000000007.png',
                          'mon_day_1_1/4.000000007.png'])
        self.assertEqual([line[8] for line in images[::2]], ['1', '1', '2', '2'])
        self.assertEqual(images[1][:3], ['10.5', '20.5', '-1'])

    def test_each_lens_has_its_model(self):
        for distortion, coefficients, model in (
                ('plumb_bob', [0.] * 5, 'PINHOLE'), ('plumb_bob', [-.125, .5, .25, 0., 0.], 'OPENCV -0.125 0.5 0.25 0.0'),
                ('plumb_bob', [-.125, .5, .25, 0., .5], 'FULL_OPENCV -0.125 0.5 0.25 0.0 0.5 0.0 0.0 0.0'),
                ('rational_polynomial', [.5, 0., 0., 0., 0., .25, 0., 1.], 'FULL_OPENCV 0.5 0.0 0.0 0.0 0.0 0.25 0.0 1.0'),
                ('equidistant', [0.] * 4, 'OPENCV_FISHEYE 0.0 0.0 0.0 0.0')):
            with self.subTest(distortion=distortion, coefficients=coefficients):
                words = Camera(320, 240, [1., 2., 3., 4.], distortion, coefficients).line().split()
                self.assertEqual(' '.join(words[:1] + words[7:]), model)
                self.assertEqual(words[1:7], '320 240 1.0 2.0 3.5 4.5'.split())

    def test_refusals_leave_nothing(self):
        self.assert_refused('made.map', 'No such file')
        self.make(version=9)
        self.assert_refused('made.map', 'version 9', 'version 10')
        self.map.unlink()
        self.make(landmarks=False)
        self.assert_refused('made.map', 'no landmarks')
        self.map.write_text('no map', encoding='utf-8')
        self.assert_refused('made.map', 'not a database')
        self.assertFalse(self.model.exists())
        self.map.unlink()
        self.make()
        self.model.mkdir()
        (self.model / 'mine').write_text('', encoding='utf-8')
        self.assert_refused('model', 'not empty')
        self.assertEqual([path.name for path in self.model.iterdir()], ['mine'])
        self.assertEqual(sorted(path.name for path in self.folder.iterdir()), ['made.map', 'model'])


if __name__ == '__main__':
    unittest.main(argv=sys.argv[:1], verbosity=2)
