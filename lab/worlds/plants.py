"""Trees, bushes and grass of many small leaves. The wind of a round moves them."""
import math
import random
from typing import Optional, Tuple

import bpy
import numpy as np

from worlds import meshes
from worlds.batch import Batch, Corner
from worlds.textures import fractal

Range = Tuple[float, float]  # of sizes
Mix = Tuple[float, Range]    # a kind's share and its sizes

# Linear colours of leaves.
GREENS = ((.1, .2, .04), (.07, .16, .05), (.16, .24, .05), (.05, .12, .05), (.2, .2, .04), (.22, .14, .04))


def leaf_textures(noise: np.random.Generator) -> list:
    """Materials of leaves: one a colour, each with light and dark specks."""
    materials = []
    for green in GREENS:
        shade = (.7 + 3.2 * fractal(64, 64, noise, 5) * noise.random((64, 64)))[..., None]
        materials.append(meshes.image_material((shade * np.array(green) * 1.3).clip(0, 1), 'leaves', 1.0))
    return materials


def bark(noise: np.random.Generator) -> 'bpy.types.Material':
    shade = np.repeat(noise.uniform(.5, 1.5, (1, 32, 1)), 64, 0) * (.5 + fractal(64, 32, noise, 5)[..., None])
    return meshes.image_material((shade * np.array([.13, .1, .075])).clip(0, 1), 'bark', 1.0)


def scatter(batch: Batch, centres: np.ndarray, size_m: float, material: 'bpy.types.Material',
            noise: np.random.Generator) -> None:
    """Square leaves in random directions, each with its own patch of the texture."""
    count = len(centres)
    across = noise.standard_normal((count, 3))
    across /= np.linalg.norm(across, axis=1)[:, None]
    up = np.cross(across, noise.standard_normal((count, 3)))
    up /= np.linalg.norm(up, axis=1)[:, None]
    half = size_m / 2 * noise.uniform(.6, 1.3, (count, 1))
    signs = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    across, up = (half * across)[:, None], (half * up)[:, None]
    corners = centres[:, None] + signs[None, :, :1] * across + signs[None, :, 1:] * up
    offset = noise.random((count, 1, 2)) * .75
    batch.faces(corners, material, offset + .125 * (signs[None] + 1))


def bent(tips: np.ndarray, heights: np.ndarray, wind: np.random.Generator) -> np.ndarray:
    """Tips of blades in the wind: together, and one by one."""
    together, alone = wind.normal(0, .25, (1, 2)), wind.normal(0, .25, (len(tips), 2))
    return tips + np.column_stack([(together + alone) * heights, np.zeros(len(tips))])


class Planter:
    """Plants trees and bushes. `noise` decides their shape; `wind` (None: calm) how the round bends them."""

    def __init__(self, batch: Batch, noise: np.random.Generator, wind: Optional[np.random.Generator] = None):
        self._batch, self._noise, self._wind = batch, noise, wind
        self._leaves, self._bark = leaf_textures(noise), bark(noise)

    def blades(self) -> list:
        return [self._leaves[k] for k in (0, 2, 4)]

    def _blown(self, centres: np.ndarray, bottom: float, strength: float) -> np.ndarray:
        """Leaves bend together and flutter one by one, the more the higher they are."""
        if self._wind is None:
            return centres
        reach = strength * np.clip((centres[:, 2:] - bottom) / 3, 0, 1.5)
        together, alone = self._wind.normal(0, .12, (1, 3)), self._wind.normal(0, .06, centres.shape)
        return centres + reach * (together + alone) * np.array([1, 1, .4])

    def tree(self, foot: Corner, rng: random.Random, scale: float) -> None:
        """A trunk, branches and a crown of several clouds of leaves."""
        x, y, z = foot
        height, noise, leaves = 2.3 * scale, self._noise, rng.choice(self._leaves)
        top = (x + rng.uniform(-.2, .2), y + rng.uniform(-.2, .2), z + height)
        self._batch.cylinder((x, y, z - .2), top, .15 * scale, self._bark, 7, .1 * scale)
        for _ in range(rng.randint(5, 8)):
            angle, out = rng.uniform(0, 2 * math.pi), rng.uniform(.2, 1.2) * scale
            middle = np.array([x + out * math.cos(angle), y + out * math.sin(angle),
                               z + height + rng.uniform(.1, 2.0) * scale])
            self._batch.cylinder(top, tuple(middle), .06 * scale, self._bark, 5, .02)
            radius = rng.uniform(.7, 1.15) * scale
            rays = noise.standard_normal((190, 3))
            rays *= (noise.uniform(.35, 1.1, (190, 1)) ** .6 * radius) / np.linalg.norm(rays, axis=1)[:, None]
            scatter(self._batch, self._blown(middle + rays, z, 1), .28 * scale, leaves, noise)

    def conifer(self, foot: Corner, rng: random.Random, scale: float) -> None:
        """A spruce: leaves on a cone."""
        x, y, z = foot
        height, noise = 7 * scale, self._noise
        self._batch.cylinder((x, y, z - .2), (x, y, z + height), .14 * scale, self._bark, 6, .03)
        share = np.sqrt(noise.random(700))
        angle = noise.uniform(0, 2 * math.pi, 700)
        tier = .75 + .25 * np.cos(share * 38)
        out = share * 1.7 * scale * tier * noise.uniform(.6, 1, 700)
        centres = np.stack([x + out * np.cos(angle), y + out * np.sin(angle), z + height * (1.02 - .9 * share)], 1)
        scatter(self._batch, self._blown(centres, z, .6), .3 * scale, self._leaves[3], noise)

    def any_plant(self, foot: Corner, rng: random.Random, trees: Mix, conifers: Mix, bushes: Range) -> None:
        """A tree, a conifer or a bush, by their shares; each in a range of sizes."""
        kind = rng.random()
        if kind < trees[0]:
            self.tree(foot, rng, rng.uniform(*trees[1]))
        elif kind < trees[0] + conifers[0]:
            self.conifer(foot, rng, rng.uniform(*conifers[1]))
        else:
            self.bush(foot, rng, rng.uniform(*bushes))

    def bush(self, foot: Corner, rng: random.Random, scale: float) -> None:
        count = int(300 * scale)
        rays = self._noise.standard_normal((count, 3))
        rays *= (self._noise.uniform(.4, 1, (count, 1)) * .8 * scale) / np.linalg.norm(rays, axis=1)[:, None]
        centres = np.array(foot) + np.abs(rays) * np.sign(rays * [1, 1, 0] + [0, 0, 1])
        scatter(self._batch, self._blown(centres, foot[2], .5), .19, rng.choice(self._leaves), self._noise)

    def hedge(self, start: Tuple[float, float], end: Tuple[float, float], size: Tuple[float, float], relief,
              rng: random.Random) -> None:
        length = math.hypot(end[0] - start[0], end[1] - start[1])
        count = int(length * (2 * size[1] + size[0]) * 55)
        noise, (dx, dy) = self._noise, ((end[0] - start[0]) / length, (end[1] - start[1]) / length)
        s, side = noise.uniform(0, length, count), noise.choice([-.5, -.4, .4, .5, 0], count)
        up = np.where(side == 0, size[1] * noise.uniform(.92, 1.05, count), size[1] * noise.random(count))
        across = np.where(side == 0, noise.uniform(-.5, .5, count), side) * size[0] + noise.normal(0, .03, count)
        x, y = start[0] + s * dx - across * dy, start[1] + s * dy + across * dx
        centres = np.stack([x, y, relief.height(x, y) + up], 1)
        scatter(self._batch, self._blown(centres, centres[:, 2].min(), .25), .17, rng.choice(self._leaves), noise)
