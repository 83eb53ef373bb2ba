"""A lens with the distortion model plumb_bob: exact remapping of a wider pinhole image, and its calibration file."""
import math
from pathlib import Path
from typing import Sequence, Tuple

import numpy as np

FILE_NAME = 'camera.yaml'
PINHOLE = (0, 0, 0, 0, 0)
_VIGNETTE = .6  # share of the natural fall of light to the corners (cos^4)


def distorted(x: np.ndarray, y: np.ndarray, coefficients: Sequence[float]) -> Tuple[np.ndarray, np.ndarray]:
    """Where a ray (x, y, 1) meets the image plane of unit focal length."""
    k1, k2, p1, p2, k3 = coefficients
    r2 = x * x + y * y
    radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    return (x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
            y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y)


def _jacobian(x: np.ndarray, y: np.ndarray, coefficients: Sequence[float]) -> Tuple[np.ndarray, ...]:
    """Derivatives of `distorted`: of x by x, of x by y (and of y by x), of y by y."""
    k1, k2, p1, p2, k3 = coefficients
    r2 = x * x + y * y
    radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    slope = 2 * (k1 + r2 * (2 * k2 + r2 * 3 * k3))
    return (radial + x * x * slope + 2 * p1 * y + 6 * p2 * x, x * y * slope + 2 * p1 * x + 2 * p2 * y,
            radial + y * y * slope + 6 * p1 * y + 2 * p2 * x)


def undistorted(u: np.ndarray, v: np.ndarray, coefficients: Sequence[float]) -> Tuple[np.ndarray, np.ndarray]:
    """The rays that `distorted` takes to (u, v), by Newton's method from the middle outwards."""
    x, y = np.zeros_like(u), np.zeros_like(v)
    for share in (.25, .5, .75, *[1.0] * 12):
        du, dv = distorted(x, y, coefficients)
        du, dv = share * u - du, share * v - dv
        xx, xy, yy = _jacobian(x, y, coefficients)
        determinant = xx * yy - xy * xy
        if (determinant < .05).any():
            break
        x, y = x + (yy * du - xy * dv) / determinant, y + (xx * dv - xy * du) / determinant
    du, dv = distorted(x, y, coefficients)
    if not (np.hypot(du - u, dv - v) < 1e-9).all():
        text = ','.join(f'{value:g}' for value in coefficients)
        raise ValueError(f'{text} folds the image over inside its corners: weaker ones or a smaller field of view')
    return x, y


class Lens:
    """Takes a wider pinhole image to what the camera sees. Pixel centres are whole numbers."""

    def __init__(self, size: Tuple[int, int], field_of_view_deg: float, coefficients: Sequence[float]):
        """`field_of_view_deg`: horizontal, of the same camera without distortion."""
        self.size = width, height = size
        self.coefficients = tuple(coefficients)
        self.focal_px = width / 2 / math.tan(math.radians(field_of_view_deg) / 2)
        self.centre = (width - 1) / 2, (height - 1) / 2
        columns, rows = np.meshgrid(np.arange(width), np.arange(height))
        x, y = undistorted((columns - self.centre[0]) / self.focal_px, (rows - self.centre[1]) / self.focal_px,
                           coefficients)
        self.pinhole_size = tuple(2 * math.ceil(np.abs(axis).max() * self.focal_px + 1.5) for axis in (x, y))
        self._columns = x * self.focal_px + (self.pinhole_size[0] - 1) / 2
        self._rows = y * self.focal_px + (self.pinhole_size[1] - 1) / 2
        self.vignette = 1 - _VIGNETTE * (1 - 1 / (1 + x * x + y * y) ** 2)

    @property
    def pinhole_angle_rad(self) -> float:
        """Horizontal field of view of the wider pinhole image."""
        return 2 * math.atan(self.pinhole_size[0] / 2 / self.focal_px)

    def remap(self, pinhole: np.ndarray) -> np.ndarray:
        """The distorted image, by bilinear interpolation."""
        column, row = np.floor(self._columns).astype(int), np.floor(self._rows).astype(int)
        fx, fy = self._columns - column, self._rows - row
        above = pinhole[row, column] * (1 - fx) + pinhole[row, column + 1] * fx
        below = pinhole[row + 1, column] * (1 - fx) + pinhole[row + 1, column + 1] * fx
        return above * (1 - fy) + below * fy


def write_calibration(path: Path, lens: Lens, name: str = 'stereo_left') -> None:
    (width, height), focal, (cx, cy) = lens.size, lens.focal_px, lens.centre
    fields = [f'image_width: {width}', f'image_height: {height}', f'camera_name: {name}',
              _matrix('camera_matrix', 3, 3, [focal, 0, cx, 0, focal, cy, 0, 0, 1]), 'distortion_model: plumb_bob',
              _matrix('distortion_coefficients', 1, 5, lens.coefficients),
              _matrix('rectification_matrix', 3, 3, [1, 0, 0, 0, 1, 0, 0, 0, 1]),
              _matrix('projection_matrix', 3, 4, [focal, 0, cx, 0, 0, focal, cy, 0, 0, 0, 1, 0])]
    path.write_text('\n'.join(fields) + '\n', encoding='utf-8')


def _matrix(name: str, rows: int, cols: int, data: Sequence[float]) -> str:
    values = ', '.join(f'{value:.10g}' for value in data)
    return f'{name}:\n  rows: {rows}\n  cols: {cols}\n  data: [{values}]'
