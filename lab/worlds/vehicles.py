"""Parked cars and people."""
import math
import random
from typing import Callable

import numpy as np

from worlds import meshes
from worlds.batch import Batch, Corner
from worlds.town_textures import placard


class Parking:
    """Parks cars on sloping ground."""

    def __init__(self, batch: Batch, rng: random.Random, noise: np.random.Generator,
                 height: Callable[[float, float], float]):
        self._batch, self._rng, self._noise, self._height = batch, rng, noise, height
        self._glass = meshes.flat_material((.02, .025, .03), 'car_glass', .12, .6)
        self._tyre = meshes.flat_material((.015, .015, .015), 'tyre')
        self._rim = meshes.flat_material((.45, .45, .47), 'rim', .4)
        self._lamp = meshes.flat_material((.75, .75, .7), 'headlight', .2, .6)
        self._tail = meshes.flat_material((.35, .01, .01), 'tail_light', .3, .5)
        self._trim = meshes.flat_material((.03, .03, .03), 'trim', .6)

    def park(self, x: float, y: float, yaw: float) -> None:
        """A car of random size and colour; vans among them."""
        rng = self._rng
        shade = rng.uniform(.02, .75)
        colour = [shade] * 3 if rng.random() < .55 else [rng.uniform(.02, .6) ** 1.4 for _ in range(3)]
        paint = meshes.flat_material(colour, 'paint', .3, .5)
        length, width = rng.uniform(3.7, 4.8), rng.uniform(1.66, 1.8)
        van = rng.random() < .15
        hood, cabin, roof = (.95, 1.0, .95) if van else (.72, .55, .8)
        self._frame(x, y, yaw)
        self._solid([(-.5, .25), (.5, .25), (.5, .55), (-.5, .6)], length, width, paint)
        self._solid([(-.5, .6), (.5, .55), (.47, hood), (-.49, hood + .08)], length, width * .97, paint)
        low, top = hood, hood + cabin
        front, back = (.3, -.47) if van else (.18, -.44)
        self._solid([(back, low), (front, low), (front - .12, top), (back + .08, top)], length, width * .9, self._glass)
        lid = [(back + .07, top - .03), (front - .11, top - .03), (front - .13, top + .06), (back + .1, top + .05)]
        self._solid(lid, length, width * .86, paint)
        for at in (front - .05, (front + back) / 2, back + .04):
            pillar = [(at - .012, low), (at + .012, low), (at - .02, top), (at - .04, top)]
            self._solid(pillar, length, width * .915, paint)
        self._solid([(-.505, .28), (.505, .28), (.505, .42), (-.505, .42)], length, width * .98, self._trim)
        self._plates(length, width)
        for u in (-.3, .31):
            for v in (-.5, .5):
                centre, out = self._at(u * length, v * width * .92, .31), self._at(u * length, v * width * 1.04, .31)
                self._batch.cylinder(centre, out, .31, self._tyre, 12)
                axle = np.subtract(out, centre)
                for share, radius, material in ((.05, .3, self._tyre), (.12, .19, self._rim)):
                    self._batch.disc(tuple(out + share * axle), tuple(axle / np.linalg.norm(axle)), radius, material)

    def _frame(self, x: float, y: float, yaw: float) -> None:
        """Axes of a car that stands with its wheels on the ground."""
        c, s = math.cos(yaw), math.sin(yaw)
        ahead = (self._height(x + c, y + s) - self._height(x - c, y - s)) / 2
        left = (self._height(x - s, y + c) - self._height(x + s, y - c)) / 2
        self._origin = np.array([x, y, self._height(x, y)])
        self._axes = np.array([[c, s, ahead], [-s, c, left], [0, 0, 1]])

    def _at(self, u: float, v: float, z: float) -> Corner:
        return tuple(self._origin + np.array([u, v, z]) @ self._axes)

    def _solid(self, outline, length: float, width: float, material) -> None:
        """A side view of four corners (share of the length, height), as wide as the car."""
        left, right = ([self._at(u * length, side * width / 2, z) for u, z in outline] for side in (1, -1))
        self._batch.prism(right, left, material)
        self._batch.quad(right[::-1], material)

    def _plates(self, length: float, width: float) -> None:
        plate = meshes.image_material(placard(self._noise, (12, 44)), 'plate')
        for end in (-.512, .512):
            lamp = self._lamp if end > 0 else self._tail
            for v0, v1, z0, z1, material in ((-.26, .26, .44, .55, plate), (-.8, -.5, .58, .72, lamp),
                                             (.5, .8, .58, .72, lamp)):
                v0, v1 = (v * width / 1.75 for v in (v0, v1))
                self._batch.quad([self._at(end * length, v0, z0), self._at(end * length, v1, z0),
                                  self._at(end * length, v1, z1), self._at(end * length, v0, z1)], material)


def add_person(batch: Batch, foot: Corner, yaw: float, rng: random.Random) -> None:
    x, y, z = foot
    coat, trousers = (meshes.flat_material([rng.uniform(.02, .5) for _ in range(3)], 'clothes') for _ in range(2))
    skin = meshes.flat_material((.5, .33, .25), 'skin')
    c, s, step = math.cos(yaw), math.sin(yaw), rng.uniform(-.25, .25)
    for side in (-.1, .1):
        reach = step if side < 0 else -step
        sx, sy = x - side * s, y + side * c
        batch.cylinder((sx + reach * c, sy + reach * s, z), (sx, sy, z + .85), .09, trousers, 7)
        batch.cylinder((x - 2.4 * side * s, y + 2.4 * side * c, z + 1.4),
                       (x - reach * c - 2.8 * side * s, y - reach * s + 2.8 * side * c, z + .8), .06, coat, 6)
    batch.cylinder((x, y, z + .8), (x, y, z + 1.48), .2, coat, 9, .17)
    batch.cylinder((x, y, z + 1.48), (x, y, z + 1.58), .06, skin, 6)
    batch.cylinder((x, y, z + 1.55), (x, y, z + 1.77), .1, skin, 8, .09)
