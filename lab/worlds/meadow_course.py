"""The path across a meadow: one closed bend after the other. Needs no Blender."""
import math
import random

import numpy as np

from worlds.campus_course import CAMERA_HEIGHT_M
from worlds.course import HillyDrive, Mount, Path, Relief, random_relief
from worlds.spec import Spec

LENGTH_M = 195.5  # 300 images at 0.65 m
SHARPEST_RAD_M = .15


class MeadowPlan:
    """Where the path is, and how high; the same in every round of a seed."""

    def __init__(self, seed: int):
        rng = random.Random(f'meadow {seed}')
        self.path = self._path(rng)
        self.relief: Relief = random_relief(rng, .015, .35, 40, 90)

    @staticmethod
    def _path(rng: random.Random) -> Path:
        """The first random bean without sharp bends."""
        angle = np.linspace(0, 2 * math.pi, 4000, endpoint=False)
        while True:
            radius = 1 + rng.uniform(.2, .3) * np.cos(2 * angle + rng.uniform(0, 7))
            radius += rng.uniform(.12, .2) * np.cos(3 * angle + rng.uniform(0, 7))
            points = radius[:, None] * np.stack([np.cos(angle), np.sin(angle)], 1)
            path = Path(points * LENGTH_M / Path(points).length_m)
            headings = np.unwrap([path.at(s)[2] for s in np.arange(0, LENGTH_M, 1.0)])
            if np.abs(np.diff(headings)).max() < SHARPEST_RAD_M:
                return path


def meadow_drive(plan: MeadowPlan, spec: Spec) -> HillyDrive:
    rng = random.Random(f'meadow {spec.seed} {spec.day} {spec.round}')
    mount = Mount(CAMERA_HEIGHT_M + spec.raise_m, spec.pitch_rad, .008)
    return HillyDrive(plan.path.wobbled(.3, rng), plan.relief, spec.spacing_m, rng, mount)
