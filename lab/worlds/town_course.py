"""The streets of a town and the course through them. Needs no Blender.

Before it is turned, moved and perhaps mirrored, the town is a crooked grid of three streets by four:

    13 --- 23 --- 33        The course drives two loops that share the street 11 -> 21:
     |      |      |          11 21 31 32 22 12, to the west through the junction 22,
    12 --- 22 --- 32          11 21 22 23 33 32 31 30 20 10, to the north through it.
     |      |      |        It drives 31 - 32 in both directions, and 11 -> 21 twice in the same direction, the second
    11 --- 21 --- 31        time 1 to 2.5 m further left. The houses left of 21 -> 31 and of 23 -> 33 are twins.
     |      |      |
    10 --- 20 --- 30
"""
import math
import random
from typing import Dict, List, Tuple

import numpy as np

from worlds.campus_course import CAMERA_HEIGHT_M
from worlds.course import HillyDrive, Mount, Path, Point, Relief, random_relief, rounded
from worlds.spec import Spec

LENGTH_M = 700.0
LANE_M = 1.4  # from the middle of the street to the robot
FIRST_LOOP = ('11', '21', '31', '32', '22', '12')
SECOND_LOOP = ('11', '21', '22', '23', '33', '32', '31', '30', '20', '10')
SHARED_STREET = ('11', '21')
TWIN_ROWS = (('21', '31'), ('23', '33'))
# Steep enough to matter, not too steep for a robot on wheels.
STEEP, STEEPEST = .05, .095
STEEP_SHARE = .3

Street = Tuple[str, str]


def _grid() -> Tuple[str, ...]:
    return tuple(f'{column}{row}' for column in (1, 2, 3) for row in (0, 1, 2, 3))


class TownPlan:
    """Where the streets are, and how high; the same in every round of a seed."""

    def __init__(self, seed: int):
        rng = random.Random(f'town {seed}')
        self.mirrored = rng.random() < .5
        self.turn_rad = math.radians(90 * rng.randrange(4) + rng.uniform(18, 36))
        columns, rows = (-50, 0, 50), (-62, -20, 20, 63)
        unit = {name: (columns[int(name[0]) - 1] + rng.uniform(-3.5, 3.5), rows[int(name[1])] + rng.uniform(-3, 3))
                for name in _grid()}
        size = 1.0
        for _ in range(4):  # corners and lanes make the length nearly, but not quite, proportional to the size
            self.nodes = {name: self._placed(point, size) for name, point in unit.items()}
            size *= LENGTH_M / self.path(LANE_M, LANE_M).length_m
        self.streets: List[Street] = [(a, b) for a in _grid() for b in _grid() if a < b and self._are_neighbours(a, b)]
        self.relief = self._relief(rng)

    def _placed(self, point: Point, size: float) -> Point:
        x, y = size * point[0], size * point[1] * (-1 if self.mirrored else 1)
        c, s = math.cos(self.turn_rad), math.sin(self.turn_rad)
        return c * x - s * y, s * x + c * y

    @staticmethod
    def _are_neighbours(a: str, b: str) -> bool:
        return abs(int(a[0]) - int(b[0])) + abs(int(a[1]) - int(b[1])) == 1

    def path(self, first_lane_m: float, second_lane_m: float) -> Path:
        """The course; the lanes are those of the shared street, metres right of its middle."""
        first, second = list(FIRST_LOOP), list(SECOND_LOOP)
        lanes: Dict[int, float] = {0: first_lane_m, 1: first_lane_m, len(first): second_lane_m}
        return Path(rounded(self._lane_vertices(first + second, lanes)))

    def _lane_vertices(self, walk: List[str], lanes: Dict[int, float]) -> List[Point]:
        """Where the lanes of successive streets meet."""
        vertices = []
        for k, name in enumerate(walk):
            here = np.array(self.nodes[name])
            before, after = (np.array(self.nodes[walk[(k + step) % len(walk)]]) - here for step in (-1, 1))
            arrive, leave = -before / np.linalg.norm(before), after / np.linalg.norm(after)
            lane_in, lane_out = lanes.get((k - 1) % len(walk), LANE_M), lanes.get(k, LANE_M)
            cross = arrive[0] * leave[1] - arrive[1] * leave[0]
            right_in, right_out = (np.array([d[1], -d[0]]) for d in (arrive, leave))
            if abs(cross) < .5:  # straight on
                aside = right_in + right_out
                vertices.append(tuple(here + aside / np.linalg.norm(aside) * (lane_in + lane_out) / 2))
                continue
            # here + lane_in * right_in + t * arrive lies on the lane of the next street.
            gap = here + lane_out * right_out - (here + lane_in * right_in)
            along = (gap[0] * leave[1] - gap[1] * leave[0]) / cross
            vertices.append(tuple(here + lane_in * right_in + along * arrive))
        return vertices

    def _relief(self, rng: random.Random) -> Relief:
        """The first random hillside that is steep enough along the course, scaled to the steepest slope."""
        path = self.path(LANE_M, LANE_M)
        s = np.arange(0, path.length_m, 1.0)
        while True:
            relief = random_relief(rng, .07, .8, 90, 160)
            relief = relief.scaled(STEEPEST / np.abs(slopes(path, relief, s)).max())
            if (np.abs(slopes(path, relief, s)) > STEEP).mean() > STEEP_SHARE:
                return relief


def slopes(path: Path, relief: Relief, s: np.ndarray) -> np.ndarray:
    """Rise a metre of travel at distances along the path."""
    (ax, ay), (bx, by) = path.point(s - .25), path.point(s + .25)
    return (relief.height(bx, by) - relief.height(ax, ay)) / np.hypot(bx - ax, by - ay)


def round_generator(spec: Spec) -> random.Random:
    """That of one round: its lanes, its wobble, its people."""
    return random.Random(f'town {spec.seed} {spec.day} {spec.round}')


def town_drive(plan: TownPlan, spec: Spec) -> HillyDrive:
    rng = round_generator(spec)
    apart = rng.uniform(1.4, 2.1)  # the wobble of both passes comes on top
    path = plan.path(LANE_M + apart / 3, LANE_M - apart * 2 / 3).wobbled(.12, rng)
    return HillyDrive(path, plan.relief, spec.spacing_m, rng, Mount(CAMERA_HEIGHT_M + spec.raise_m, spec.pitch_rad))
