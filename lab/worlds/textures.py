"""Procedural textures as arrays of linear colour, rows from the top. Needs no Blender.

Two generators are drawn from: `plan` (random.Random) decides what stands where, `noise`
(numpy Generator) fills surfaces. The order of the draws is part of the campus: another order
is another campus.
"""
import math
import random

import numpy as np

Array = np.ndarray

# Things on a wall at street level: height, width and height above the ground, metres.
_SIGN_SIZES = {
    'sign': (.5, 1.6, 2.4),
    'poster': (1.0, .8, 1.0),
    'vent': (.5, .7, .4),
    'graffiti': (1.0, 2.6, .5),
}


def fractal(height: int, width: int, noise: np.random.Generator, octaves: int = 6) -> Array:
    """Value noise in [0, 1]: octaves of bilinear grids, each finer and weaker than the one before."""
    result = np.zeros((height, width))
    amplitude, total = 1, 0
    for octave in range(octaves):
        cells = 2 ** (octave + 2)
        grid = noise.random((cells + 1, cells + 1))
        rows, cols = np.linspace(0, cells - 1e-6, height), np.linspace(0, cells - 1e-6, width)
        row, col = rows.astype(int), cols.astype(int)
        fy, fx = (rows - row)[:, None], (cols - col)[None]
        value = (grid[row][:, col] * (1 - fy) * (1 - fx) + grid[row + 1][:, col] * fy * (1 - fx)
                 + grid[row][:, col + 1] * (1 - fy) * fx + grid[row + 1][:, col + 1] * fy * fx)
        result += amplitude * value
        total += amplitude
        amplitude *= .55
    return result / total


class FacadePainter:
    """Paints one wall after the other: surface, windows, and what hangs at street level."""

    def __init__(self, plan: random.Random, noise: np.random.Generator):
        self._plan = plan
        self._noise = noise

    def paint(self, width_m: float, height_m: float, pixels_per_metre: int) -> Array:
        """A wall of the given size, float32 RGB in [0, 1]."""
        height, width = int(height_m * pixels_per_metre), int(width_m * pixels_per_metre)
        base = np.array([self._plan.uniform(.3, .75) for _ in range(3)])
        base = .6 * base + .4 * base.mean()
        wall = base[None, None] * (.75 + .5 * fractal(height, width, self._noise)[..., None])
        self._add_surface(wall, pixels_per_metre)
        self._add_windows(wall, width_m, height_m, pixels_per_metre)
        for _ in range(int(width_m / 7) + 1):
            self._add_street_level(wall, width_m, pixels_per_metre)
        return wall.clip(0, 1).astype(np.float32)

    def _add_surface(self, wall: Array, ppm: int) -> None:
        height, width = wall.shape[:2]
        style = self._plan.choice(['brick', 'panel', 'plaster'])
        if style == 'brick':
            for row in range(0, height, 8):
                wall[row:row + 1] *= .7
                for col in range((row // 8 % 2) * 10, width, 20):
                    wall[row:row + 8, col:col + 1] *= .75
                    wall[row:row + 8, col:col + 20] *= self._noise.uniform(.88, 1.12)
        elif style == 'panel':
            for col in range(0, width, int(ppm * 1.5)):
                wall[:, col:col + 3] *= .6
            for row in range(0, height, int(ppm * 3)):
                wall[row:row + 3] *= .6

    def _add_windows(self, wall: Array, width_m: float, height_m: float, ppm: int) -> None:
        plan, height = self._plan, wall.shape[0]
        floor_m, pitch_m = plan.uniform(2.8, 3.6), plan.uniform(2.0, 4.5)
        window_w, window_h = plan.uniform(.9, pitch_m * .75), plan.uniform(1.0, 1.9)
        y = .9
        while y + window_h < height_m:
            x = plan.uniform(.4, 1.2)
            while x + window_w < width_m:
                top, bottom = height - int((y + window_h) * ppm), height - int(y * ppm)
                left, right = int(x * ppm), int((x + window_w) * ppm)
                if plan.random() < .93:
                    self._add_window(wall, top, bottom, left, right)
                x += pitch_m + plan.uniform(-.25, .25)
            y += floor_m

    def _add_window(self, wall: Array, top: int, bottom: int, left: int, right: int) -> None:
        plan = self._plan
        wall[top - 4:bottom + 4, left - 4:right + 4] = plan.choice([.85, .2, .5, .7])
        darkness = plan.uniform(.03, .18)
        glass = fractal(bottom - top, right - left, self._noise, 3)[..., None]
        wall[top:bottom, left:right] = darkness * (.6 + .8 * glass)
        panes = plan.choice([1, 2, 2, 3])
        for pane in range(1, panes):
            bar = left + (right - left) * pane // panes
            wall[top:bottom, bar - 2:bar + 2] = .7
        if plan.random() < .4:
            cloth = plan.uniform(.5, .85)
            drawn = int((bottom - top) * plan.uniform(.2, .8))
            wall[top:top + drawn, left:right] = cloth
        if plan.random() < .3:
            wall[bottom:bottom + 8, left - 8:right + 8] = .75

    def _add_street_level(self, wall: Array, width_m: float, ppm: int) -> None:
        plan = self._plan
        left = int(plan.uniform(.5, max(.6, width_m - 2.5)) * ppm)
        kind = plan.choice(['door', 'sign', 'poster', 'vent', 'pipe', 'graffiti'])
        if kind == 'door':
            self._add_door(wall, left, ppm)
        elif kind == 'pipe':
            wall[:, left:left + 6] *= .5
            wall[:, left + 2:left + 3] *= 1.6
        else:
            self._add_pattern(wall, left, kind, ppm)

    def _add_door(self, wall: Array, left: int, ppm: int) -> None:
        right, top = left + int(1.3 * ppm), wall.shape[0] - int(2.2 * ppm)
        wall[top:, left:right] = [self._plan.uniform(.05, .6) for _ in range(3)]
        wall[top:, left:left + 3] = .8
        wall[top:top + 3, left:right] = .8
        wall[top + 12:top + 40, left + 10:right - 10] = .1

    def _add_pattern(self, wall: Array, left: int, kind: str, ppm: int) -> None:
        """A random black-and-white pattern in two colours: no two signs are alike."""
        height, width, above_ground = (metres * ppm for metres in _SIGN_SIZES[kind])
        top = int(wall.shape[0] - above_ground - height)
        bottom, right = int(top + height), int(left + width)
        cells = (max(2, int(height / 7)), max(2, int(width / 6)))
        pattern = (self._noise.random(cells) < .5).astype(float)
        cell_size = (math.ceil((bottom - top) / cells[0]), math.ceil((right - left) / cells[1]))
        pattern = np.kron(pattern, np.ones(cell_size))[:bottom - top, :right - left]
        ink, paper = self._noise.random(3) * .4, .5 + self._noise.random(3) * .5
        area = wall[top:bottom, left:right]
        pattern = pattern[:area.shape[0], :area.shape[1]]
        wall[top:bottom, left:right] = pattern[..., None] * ink + (1 - pattern[..., None]) * paper


def ground(low_m: float, high_m: float, building: tuple, noise: np.random.Generator) -> Array:
    """The square [low, high]^2 seen from above: paths around the building, lawns, kerbs, road marks.

    `building` is (length, width) of the main building, whose corner is the origin.
    """
    size = 2048
    gravel = .16 + .2 * fractal(size, size, noise, 9)
    rgb = np.stack([gravel, gravel, gravel], -1)
    patches = fractal(size, size, noise, 5)
    grass = np.stack([.10 + .12 * patches, .2 + .2 * patches, .06 + .06 * patches], -1)
    grass = grass * (.6 + .8 * noise.random((size, size, 1)))
    axis = np.linspace(low_m, high_m, size)
    x, y = np.meshgrid(axis, axis[::-1])
    distance = np.maximum(np.maximum(-x, x - building[0]), np.maximum(-y, y - building[1]))
    is_grass = (distance > 17) | ((distance < 5.5) & (patches > .5))
    rgb[is_grass] = grass[is_grass]
    rgb[(np.abs(distance - 13.0) < .08) & ((x + y) % 6 < 3)] = .8
    rgb[np.abs(distance - 5.5) < .12] = .55
    rgb[(distance > 6) & (distance < 13) & (np.abs(x - 30) < .1)] = .75
    return rgb.clip(0, 1).astype(np.float32)


def leaves(noise: np.random.Generator) -> Array:
    shade = fractal(64, 64, noise, 5)
    rgb = np.stack([.06 + .1 * shade, .14 + .25 * shade, .04 + .05 * shade], -1)
    return (rgb * (noise.random((64, 64, 1)) * 1.3)).clip(0, 1).astype(np.float32)


def wood(noise: np.random.Generator) -> Array:
    shade = fractal(128, 256, noise, 7)
    rgb = np.stack([.05 + .12 * shade, .12 + .2 * shade, .04 + .06 * shade], -1)
    return (rgb * (.5 + noise.random((128, 256, 1)))).clip(0, 1).astype(np.float32)


def street_sign(noise: np.random.Generator) -> Array:
    pattern = (noise.random((6, 9)) < .5) * .7 + .15
    return np.kron(pattern, np.ones((8, 8))).astype(np.float32)
