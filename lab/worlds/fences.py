"""What stands between gardens and pavements."""
import math
import random

import numpy as np

from worlds import meshes
from worlds.batch import Batch
from worlds.plants import Planter
from worlds.town_textures import stones

KINDS = ('hedge', 'hedge', 'picket', 'picket', 'wall', 'wall', 'rail', 'none')


class Fences:
    """Hedges, picket fences, stone walls and rails that follow the ground."""

    def __init__(self, batch: Batch, relief, planter: Planter, noise: np.random.Generator):
        self._batch, self._relief, self._planter = batch, relief, planter
        self._stone = [meshes.image_material(stones(noise), 'stones', .95) for _ in range(4)]
        self._paints = [meshes.flat_material(rgb, 'fence', .8) for rgb in
                        ((.6, .58, .54), (.16, .1, .06), (.05, .12, .09), (.28, .22, .15))]
        self._iron = meshes.flat_material((.04, .04, .045), 'iron', .5)

    def add(self, kind: str, start: np.ndarray, end: np.ndarray, rng: random.Random) -> None:
        length = float(np.linalg.norm(end - start))
        if kind == 'none' or length < .5:
            return
        if kind == 'hedge':
            self._planter.hedge(tuple(start), tuple(end), (.6, rng.uniform(.7, 1.5)), self._relief, rng)
        elif kind == 'wall':
            self._wall(start, end, rng.uniform(.5, 1.3), rng.choice(self._stone), rng.random())
        elif kind == 'picket':
            self._pickets(start, end, rng.uniform(.8, 1.3), .09, rng.choice([.13, .16, .2]), rng.choice(self._paints))
        else:
            self._pickets(start, end, rng.uniform(.9, 1.2), .025, .15, self._iron)

    def _stations(self, start: np.ndarray, end: np.ndarray, step_m: float) -> np.ndarray:
        length = float(np.linalg.norm(end - start))
        share = np.linspace(0, 1, max(2, math.ceil(length / step_m) + 1))[:, None]
        points = start + (end - start) * share
        return np.column_stack([points, self._relief.height(points[:, 0], points[:, 1])])

    def _wall(self, start: np.ndarray, end: np.ndarray, height: float, material, shift: float) -> None:
        points = self._stations(start, end, 2)
        across = np.array([-(end - start)[1], (end - start)[0], 0]) / np.linalg.norm(end - start) * .15
        u = shift
        for a, b in zip(points[:-1], points[1:]):
            after = u + np.linalg.norm(b - a) / 6.4
            up, down = np.array([0, 0, height]), np.array([0, 0, -.3])
            for side in (across, -across):
                self._batch.quad([a + side + down, b + side + down, b + side + up, a + side + up], material,
                                 (u, 0, after, (height + .3) / 1.6))
            self._batch.quad([a - across + up, b - across + up, b + across + up, a + across + up], material,
                             (u, .1, after, .25))
            u = after

    def _pickets(self, start: np.ndarray, end: np.ndarray, height: float, width: float, gap: float, material) -> None:
        along = (end - start) / np.linalg.norm(end - start)
        half = np.array([*along, 0]) * width / 2
        points = self._stations(start, end, gap)
        up = np.array([0, 0, height])
        quads = np.stack([points - half, points + half, points + half + up, points - half + up], 1)
        self._batch.faces(quads, material, np.broadcast_to([(0, 0), (1, 0), (1, 1), (0, 1)], (len(quads), 4, 2)))
        for level in (.25, .75):
            low, high = np.array([0, 0, height * level - .04]), np.array([0, 0, height * level + .04])
            for a, b in zip(points[:-1:4], list(points[4::4]) + [points[-1]]):
                self._batch.quad([a + low, b + low, b + high, a + high], material)
