"""Closed courses over hilly ground: smooth paths, the relief below them, and the camera's poses. Needs no Blender.

Local east-north-up frame, metres and radians; yaw 0 looks east, counter-clockwise.
"""
import math
import random
from dataclasses import dataclass
from typing import Callable, Iterator, List, Sequence, Tuple

import numpy as np

from worlds.campus_course import CAMERA_HEIGHT_M, CameraPose

STEP_M = .05  # between the points of a path
CORNER_RADIUS_M = 5.0

Point = Tuple[float, float]


class Relief:
    """Smooth ground: a hillside with waves. Its height is a function of the position alone."""

    def __init__(self, slope: Point, waves: Sequence[Tuple[float, float, float, float]]):
        """`slope`: rise a metre towards east and north; a wave has amplitude, wave numbers east and north, phase."""
        self._slope = slope
        self._waves = tuple(waves)

    def scaled(self, factor: float) -> 'Relief':
        """The same hills, higher or lower."""
        return Relief((self._slope[0] * factor, self._slope[1] * factor),
                      [(amplitude * factor, *rest) for amplitude, *rest in self._waves])

    def height(self, x, y):
        """Above the origin; of numbers or arrays."""
        ground = self._slope[0] * x + self._slope[1] * y
        for amplitude, kx, ky, phase in self._waves:
            ground = ground + amplitude * (np.sin(kx * x + ky * y + phase) - math.sin(phase))
        return ground

    def gradient(self, x, y):
        """Rise a metre towards east and towards north."""
        east, north = self._slope[0] + 0 * x, self._slope[1] + 0 * x
        for amplitude, kx, ky, phase in self._waves:
            swing = amplitude * np.cos(kx * x + ky * y + phase)
            east, north = east + kx * swing, north + ky * swing
        return east, north


def random_relief(rng: random.Random, slope: float, amplitude_m: float, shortest_m: float, longest_m: float) -> Relief:
    """A hillside with four waves, in random directions."""
    towards = rng.uniform(0, 2 * math.pi)
    waves = []
    for _ in range(4):
        direction, number = rng.uniform(0, 2 * math.pi), 2 * math.pi / rng.uniform(shortest_m, longest_m)
        waves.append((amplitude_m * rng.uniform(.5, 1), number * math.cos(direction), number * math.sin(direction),
                      rng.uniform(0, 2 * math.pi)))
    return Relief((slope * math.cos(towards), slope * math.sin(towards)), waves)


def rotation(roll: float, pitch: float, yaw: float) -> np.ndarray:
    """From the axes of a body (x ahead, y left, z up) to east, north and up; pitch is upwards."""
    (cr, sr), (cp, sp), (cy, sy) = ((math.cos(angle), math.sin(angle)) for angle in (roll, pitch, yaw))
    return (np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]]) @ np.array([[cp, 0, -sp], [0, 1, 0], [sp, 0, cp]])
            @ np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]]))


def angles(body: np.ndarray) -> Tuple[float, float, float]:
    """Roll, pitch (upwards) and yaw of a rotation."""
    return (math.atan2(body[2, 1], body[2, 2]), math.asin(max(-1, min(1, body[2, 0]))),
            math.atan2(body[1, 0], body[0, 0]))


def rounded(vertices: Sequence[Point]) -> np.ndarray:
    """A closed polygon with round corners as points, STEP_M apart or closer.

    Corners up to 90 degrees touch their legs 5 m before the vertex: the weaker the turn, the wider the arc.
    """
    points: List[np.ndarray] = []
    corners = np.asarray(vertices, float)
    count = len(corners)
    for k in range(count):
        before, corner, after = corners[k - 1], corners[k], corners[(k + 1) % count]
        arrive = (corner - before) / np.linalg.norm(corner - before)
        leave = (after - corner) / np.linalg.norm(after - corner)
        turn = math.atan2(arrive[0] * leave[1] - arrive[1] * leave[0], float(arrive @ leave))
        half = math.tan(abs(turn) / 2)
        tangent = max(CORNER_RADIUS_M, CORNER_RADIUS_M * half)
        start = corner - tangent * arrive
        if abs(turn) < 1e-6:
            points.append(start[None])
            continue
        radius = tangent / half
        left = math.copysign(1, turn) * np.array([-arrive[1], arrive[0]])
        angles = np.linspace(0, turn, max(2, math.ceil(radius * abs(turn) / STEP_M)))[:, None]
        centre = start + radius * left
        spoke = -radius * left
        points.append(centre + np.cos(angles) * spoke + np.sin(angles) * np.array([-spoke[1], spoke[0]]))
    return np.concatenate([_filled(points[k], points[(k + 1) % count][0]) for k in range(count)])


def _filled(points: np.ndarray, end: np.ndarray) -> np.ndarray:
    """The points and the straight leg behind them, without its end."""
    gap = np.linalg.norm(end - points[-1])
    steps = max(1, math.ceil(gap / STEP_M))
    leg = points[-1] + (end - points[-1]) * (np.arange(1, steps) / steps)[:, None]
    return np.concatenate([points, leg])


class Path:
    """A closed smooth path."""

    def __init__(self, points: np.ndarray):
        self._points = np.concatenate([points, points[:1]])
        self._s = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(self._points, axis=0), axis=1))])
        self.length_m = float(self._s[-1])

    def point(self, s):
        """East and north after `s` metres, of a number or an array."""
        s = np.mod(s, self.length_m)
        return np.interp(s, self._s, self._points[:, 0]), np.interp(s, self._s, self._points[:, 1])

    def at(self, s: float) -> Tuple[float, float, float]:
        """East, north and the direction of travel after `s` metres."""
        x, y = self.point(s)
        (bx, by), (ax, ay) = self.point(s - 2 * STEP_M), self.point(s + 2 * STEP_M)
        return float(x), float(y), math.atan2(ay - by, ax - bx)

    def wobbled(self, amplitude_m: float, rng: random.Random) -> 'Path':
        """A path that swings to both sides of this one, other in every round."""
        s = np.arange(0, self.length_m, STEP_M)
        x, y = self.point(s)
        (bx, by), (ax, ay) = self.point(s - .5), self.point(s + .5)
        heading = np.arctan2(ay - by, ax - bx)
        turns = 2 * math.pi * s / self.length_m
        aside = np.zeros_like(s)
        for wavelength_m, share in ((55, .6), (21, .4)):
            aside += share * np.sin(round(self.length_m / wavelength_m) * turns + rng.uniform(0, 2 * math.pi))
        aside *= amplitude_m
        return Path(np.stack([x - aside * np.sin(heading), y + aside * np.cos(heading)], 1))


@dataclass
class Mount:
    """How the camera sits on the robot and shakes."""

    height_m: float = CAMERA_HEIGHT_M
    pitch_rad: float = 0  # upwards
    shake_rad: float = .004


class HillyDrive:
    """One image a second, every `spacing_m` along a closed path; the robot leans as the ground does."""

    def __init__(self, path: Path, relief: Relief, spacing_m: float, rng: random.Random, mount: Mount = Mount()):
        self.path, self.relief, self.mount = path, relief, mount
        self.length_m = path.length_m
        self.count = int(path.length_m / spacing_m)
        self._spacing_m = spacing_m
        self._rng = rng
        self.on_move: Callable[[float, float], None] = lambda x, y: None  # called where an image is taken

    def poses(self) -> Iterator[CameraPose]:
        """The camera poses in order. They draw from the round's generator, so consume them once and all."""
        rng, shake = self._rng, self.mount.shake_rad
        for index in range(self.count):
            s = index * self._spacing_m + rng.uniform(-.05, .05)
            pose = self.pose(index, s, [rng.gauss(0, shake) for _ in range(3)])
            pose.render_seed = rng.randrange(1 << 30)
            pose.rates = tuple(rng.gauss(0, 10 * shake) for _ in range(3))
            yield pose

    def pose(self, index: int, s: float, shake: Sequence[float] = (0, 0, 0)) -> CameraPose:
        """The pose after `s` metres; `shake` is added to roll, pitch and yaw."""
        x, y, heading = self.path.at(s)
        east, north = (float(value) for value in self.relief.gradient(x, y))
        ahead = math.cos(heading) * east + math.sin(heading) * north
        # The left axis of a robot that stands on the ground rises by the slope to its left.
        leftwards = -math.sin(heading) * east + math.cos(heading) * north
        robot = rotation(math.atan2(leftwards, math.sqrt(1 + ahead * ahead)), math.atan(ahead), heading)
        roll, pitch, yaw = angles(robot @ rotation(shake[0], self.mount.pitch_rad + shake[1], shake[2]))
        up = robot[:, 2] * self.mount.height_m
        return CameraPose(index, index * 1.0, x + up[0], y + up[1], float(self.relief.height(x, y)) + up[2],
                          yaw, pitch, 0, roll)
