"""The lens of the renderer against OpenCV's model of it, and the calibration file that it writes."""
import sys
import tempfile
import unittest
from pathlib import Path

import cv2
import numpy as np
import yaml

LAB = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(LAB))
from worlds.lens import PINHOLE, Lens, write_calibration  # noqa: E402

TOWN = (-.28, .09, 0, 0, 0)
CROOKED = (-.31, .12, .002, -.0015, -.02)
STRONGEST_PX = .05


def rays_of(lens: Lens) -> np.ndarray:
    """What a remapped image of its own coordinates says: the ray of every pixel."""
    width, height = lens.pinhole_size
    columns, rows = np.meshgrid(np.arange(width, dtype=float), np.arange(height, dtype=float))
    x, y = (lens.remap(axis - (side - 1) / 2) / lens.focal_px for axis, side in ((columns, width), (rows, height)))
    return np.stack([x, y, np.ones_like(x)], -1).reshape(-1, 3)


class LensTest(unittest.TestCase):
    def assert_projects_back(self, lens: Lens):
        """Each ray falls on its own pixel by cv2.projectPoints."""
        camera = np.array([[lens.focal_px, 0, lens.centre[0]], [0, lens.focal_px, lens.centre[1]], [0, 0, 1]])
        pixels = cv2.projectPoints(rays_of(lens), np.zeros(3), np.zeros(3), camera, np.array(lens.coefficients))[0]
        columns, rows = np.meshgrid(np.arange(lens.size[0]), np.arange(lens.size[1]))
        error = np.abs(pixels.reshape(-1, 2) - np.stack([columns, rows], -1).reshape(-1, 2)).max()
        self.assertLess(error, STRONGEST_PX)

    def test_remaps_as_opencv_projects(self):
        for size, field, coefficients in (((320, 240), 62, TOWN), ((320, 240), 62, CROOKED), ((97, 61), 40, CROOKED),
                                          ((240, 320), 50, TOWN), ((320, 240), 62, (.1, .02, 0, 0, 0))):
            with self.subTest(size=size, coefficients=coefficients):
                self.assert_projects_back(Lens(size, field, coefficients))

    def test_without_distortion_nothing_moves(self):
        lens = Lens((64, 48), 60, PINHOLE)
        self.assertLess(np.abs(rays_of(lens)[0] - [-31.5 / lens.focal_px, -23.5 / lens.focal_px, 1]).max(), 1e-9)

    def test_refuses_a_lens_that_folds_the_image(self):
        with self.assertRaisesRegex(ValueError, '-0.9,0,0,0,0 folds'):
            Lens((320, 240), 90, (-.9, 0, 0, 0, 0))

    def test_corners_are_darker(self):
        vignette = Lens((320, 240), 62, TOWN).vignette
        self.assertGreater(vignette[120, 160], .99)
        self.assertLess(vignette[0, 0], .8)

    def test_the_calibration_is_that_of_the_lens(self):
        lens = Lens((320, 240), 62, TOWN)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / 'camera.yaml'
            write_calibration(path, lens)
            calibration = yaml.safe_load(path.read_text(encoding='utf-8'))
        self.assertEqual((calibration['image_width'], calibration['image_height']), (320, 240))
        self.assertEqual(calibration['distortion_coefficients']['data'], list(TOWN))
        self.assertAlmostEqual(calibration['camera_matrix']['data'][0], lens.focal_px, places=6)
        self.assertEqual(calibration['camera_matrix']['data'][2], 159.5)

    def test_the_campus_has_the_calibration_that_ships(self):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / 'camera.yaml'
            write_calibration(path, Lens((320, 240), 62, PINHOLE))
            self.assertEqual(yaml.safe_load(path.read_text(encoding='utf-8')),
                             yaml.safe_load((LAB.parent / 'test/data/calibration/campus.yaml').read_text(encoding='utf-8')))


if __name__ == '__main__':
    unittest.main(verbosity=2)
