"""Houses with gabled roofs: a design, which twins share, and where it stands."""
import math
import random
from dataclasses import dataclass
from typing import List, Tuple

import bpy
import numpy as np

from worlds import meshes
from worlds.batch import Batch, Corner
from worlds.town_textures import FLOOR_M, HousePainter

Point = Tuple[float, float]


@dataclass
class Site:
    """Where a house stands: the middle of its front, the direction along the front and the one to its back.

    `along` and `back` need not be a right-handed pair: in a mirrored town they are not.
    """

    front: Point
    along: Point
    back: Point

    def at(self, u: float, v: float, z: float = 0) -> Corner:
        """`u` metres along the front from its middle, `v` metres behind it."""
        return (self.front[0] + u * self.along[0] + v * self.back[0],
                self.front[1] + u * self.along[1] + v * self.back[1], z)

    def outline(self, width_m: float, depth_m: float) -> np.ndarray:
        w, d = width_m / 2, depth_m
        return np.array([self.at(u, v)[:2] for u, v in ((-w, 0), (w, 0), (w, d), (-w, d))])


class House:
    """Walls, roof, chimney and steps of one design."""

    def __init__(self, plan: random.Random, noise: np.random.Generator, roofs: List['bpy.types.Material'],
                 stone: 'bpy.types.Material'):
        self.width_m, self.depth_m = plan.uniform(7.5, 11.5), plan.uniform(6.8, 8)
        self.floors = plan.choice([1, 2, 2, 2, 3])
        self.wall_m = self.floors * FLOOR_M
        self.is_shop = plan.random() < .22
        self.gable_to_street = plan.random() < .4
        span = self.width_m if self.gable_to_street else self.depth_m
        self.ridge_m = span / 2 * math.tan(math.radians(plan.uniform(32, 50)))
        self._roof, self._stone = plan.choice(roofs), stone
        self._chimney = (plan.uniform(-.3, .3), plan.uniform(.4, .6))
        self._dormer = plan.uniform(-.2, .2) if not self.gable_to_street and plan.random() < .5 else None
        painter = HousePainter(plan, noise)
        front, side = painter.front(self.width_m, self.floors, self.is_shop), painter.side(self.depth_m, self.floors)
        self._walls = [front, side, painter.side(self.width_m, self.floors), painter.side(self.depth_m, self.floors)]
        gable = painter.gable(span, self.ridge_m)
        self._gable = meshes.image_material(gable.rgb, 'gable')
        self._materials = [meshes.image_material(wall.rgb, 'wall') for wall in self._walls]

    def add(self, batch: Batch, site: Site, ground: List[float]) -> float:
        """Builds the house above the ground's heights at its corners (and front); returns the height of its floor."""
        floor, low = max(ground) + .12, min(ground) - .3
        w, d = self.width_m / 2, self.depth_m
        plan = [(-w, 0), (w, 0), (w, d), (-w, d)]
        batch.prism([site.at(1.01 * u, v + (-.06 if v == 0 else .06), low) for u, v in plan],
                    [site.at(1.01 * u, v + (-.06 if v == 0 else .06), floor) for u, v in plan], self._stone)
        for k, material in enumerate(self._materials):
            a, b = plan[k], plan[(k + 1) % 4]
            batch.quad([site.at(*a, floor), site.at(*b, floor), site.at(*b, floor + self.wall_m),
                        site.at(*a, floor + self.wall_m)], material)
        self._add_roof(batch, site, floor + self.wall_m)
        self._add_steps(batch, site, floor, min(ground))
        return floor

    def _turned(self, across: float, along: float) -> Tuple[float, float]:
        """From the roof's own axes (along its ridge, across it) to those of the site."""
        if self.gable_to_street:
            return across, along + self.depth_m / 2
        return along, across + self.depth_m / 2

    def _add_roof(self, batch: Batch, site: Site, eave: float) -> None:
        span, length = (self.width_m, self.depth_m) if self.gable_to_street else (self.depth_m, self.width_m)
        over, half, end = .45, span / 2, length / 2
        fall = over * self.ridge_m / half
        slope = math.hypot(half + over, self.ridge_m + fall)
        for side in (-1, 1):
            corners = [self._turned(side * (half + over), -end - over), self._turned(side * (half + over), end + over),
                       self._turned(0, end + over), self._turned(0, -end - over)]
            heights = (eave - fall, eave - fall, eave + self.ridge_m, eave + self.ridge_m)
            batch.quad([site.at(u, v, z + .06) for (u, v), z in zip(corners, heights)], self._roof,
                       (0, 0, (length + 2 * over) / 6.4, slope / 6.4))
            # The edge of the roof, as dark as what is below it.
            batch.quad([site.at(*corners[0], eave - fall - .12), site.at(*corners[1], eave - fall - .12),
                        site.at(*corners[1], eave - fall + .06), site.at(*corners[0], eave - fall + .06)], self._roof,
                       (0, 0, length / 6.4, .02))
            ends = [self._turned(-half, side * end), self._turned(half, side * end), self._turned(0, side * end)]
            batch.triangle([site.at(u, v, z) for (u, v), z in zip(ends, (eave, eave, eave + self.ridge_m))],
                           self._gable)
        u, v = self._chimney[0] * self.width_m, self._chimney[1] * self.depth_m
        for size, bottom, top in ((.32, eave, eave + self.ridge_m + .7), (.4, eave + self.ridge_m + .6,
                                                                          eave + self.ridge_m + .75)):
            ring = [(u - size, v - size), (u + size, v - size), (u + size, v + size), (u - size, v + size)]
            batch.prism([site.at(*p, bottom) for p in ring], [site.at(*p, top) for p in ring], self._stone)
        if self._dormer is not None:
            self._add_dormer(batch, site, eave)

    def _add_dormer(self, batch: Batch, site: Site, eave: float) -> None:
        u, w, v = self._dormer * self.width_m, .8, self.depth_m * .12
        low, high = eave + .1, eave + min(1.7, self.ridge_m * .8)
        batch.quad([site.at(u - w, v, low), site.at(u + w, v, low), site.at(u + w, v, high), site.at(u - w, v, high)],
                   self._gable, (.3, .05, .7, .6))
        back = self.depth_m * .45
        lid = ((u - w - .2, v - .2), (u + w + .2, v - .2), (u + w + .2, back), (u - w - .2, back))
        batch.quad([site.at(*corner, high) for corner in lid], self._roof, (0, 0, .3, .5))
        for side in (-w, w):
            batch.quad([site.at(u + side, v, low), site.at(u + side, back, low), site.at(u + side, back, high),
                        site.at(u + side, v, high)], self._stone)

    def _add_steps(self, batch: Batch, site: Site, floor: float, low: float) -> None:
        for k in range(3):
            reach = .35 * (3 - k)
            door = self._walls[0].door_m - self.width_m / 2
            ring = [(door - .9, -reach), (door + .9, -reach), (door + .9, 0), (door - .9, 0)]
            top = floor - .12 * (3 - k)
            batch.prism([site.at(*p, low - .2) for p in ring], [site.at(*p, top) for p in ring], self._stone)

    def lit_windows(self, site: Site, floor: float, rng: random.Random, share: float) -> List[List[Corner]]:
        """Some windows of the front and the sides, a little in front of the wall."""
        w, d, lit = self.width_m / 2, self.depth_m, []
        # Of each wall: where it starts, where it leads, and outwards.
        axes = [((-w, 0), (1, 0), (0, -1)), ((w, 0), (0, 1), (1, 0)), ((w, d), (-1, 0), (0, 1)),
                ((-w, d), (0, -1), (-1, 0))]
        for wall, (start, along, out) in zip(self._walls, axes):
            for left, bottom, right, top in wall.windows:
                if rng.random() >= share:
                    continue
                u, v = start[0] + .015 * out[0], start[1] + .015 * out[1]
                lit.append([site.at(u + s * along[0], v + s * along[1], floor + z)
                            for s, z in ((left, bottom), (right, bottom), (right, top), (left, top))])
        return lit
