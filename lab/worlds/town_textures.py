"""Textures of houses, roofs, fences and streets as arrays of linear colour, rows from the top. Needs no Blender."""
import math
import random
from dataclasses import dataclass, field
from typing import List, Tuple

import numpy as np

from worlds.textures import fractal

Array = np.ndarray
PIXELS_PER_METRE = 40
FLOOR_M = 2.8

# Linear colours of plaster, and of what is painted in a signal colour.
_PLASTERS = ((.62, .55, .42), (.7, .66, .56), (.5, .3, .2), (.36, .42, .46), (.66, .5, .24), (.42, .48, .34),
             (.55, .36, .32), (.74, .72, .7), (.3, .26, .24), (.6, .44, .36))
_PAINTS = ((.35, .04, .03), (.03, .12, .3), (.04, .2, .08), (.5, .32, .05), (.04, .04, .05), (.45, .42, .38),
           (.22, .1, .05))


@dataclass
class Wall:
    """A painted wall, and where its windows are: left, bottom, right and top in metres."""

    rgb: Array
    door_m: float = 0  # from its left edge
    windows: List[Tuple[float, float, float, float]] = field(default_factory=list)


def strong(noise: Array) -> Array:
    """Value noise with more contrast."""
    return ((noise - .5) * 2.6 + .5).clip(0, 1)


def glyphs(height: int, width: int, noise: np.random.Generator) -> Array:
    """A mask that looks like writing: random cells, less in the gaps between words."""
    rows, cols = max(3, height // 4), max(4, width // 4)
    cells = noise.random((rows, cols)) < .5
    cells[[0, -1]] = False
    cells[:, ::5] = False
    zoom = np.kron(cells, np.ones((math.ceil(height / rows), math.ceil(width / cols))))
    return zoom[:height, :width, None]


def box_of(rgb: Array, left: float, bottom: float, right: float, top: float) -> Array:
    """The part of a wall between metres from its lower left corner; may be empty at the edges."""
    height, ppm = rgb.shape[0], PIXELS_PER_METRE
    rows = slice(max(0, height - int(round(top * ppm))), max(0, height - int(round(bottom * ppm))))
    return rgb[rows, max(0, int(round(left * ppm))):max(0, int(round(right * ppm)))]


class HousePainter:
    """Paints the walls of one house in one style."""

    def __init__(self, plan: random.Random, noise: np.random.Generator):
        self._plan, self._noise = plan, noise
        self._base = np.array(plan.choice(_PLASTERS)) * plan.uniform(.8, 1.15)
        self._style = plan.choice(['plaster', 'plaster', 'brick', 'timber', 'panel'])
        self._frame = plan.choice([.8, .75, .15, .3])
        self._shutters = np.array(plan.choice(_PAINTS)) if plan.random() < .45 else None
        self._window_m = (plan.uniform(.9, 1.3), plan.uniform(1.2, 1.5))
        self._pitch_m = plan.uniform(1.9, 2.7)
        self._panes = plan.choice([1, 2, 2, 3])

    def front(self, width_m: float, floors: int, shop: bool) -> Wall:
        """The wall to the street, with a door or a shop."""
        wall = self._bare(width_m, floors)
        door = width_m * self._plan.choice([.22, .5, .78])
        for level in range(floors):
            if level == 0 and shop:
                self._add_shop(wall, width_m)
            else:
                self._add_windows(wall, width_m, level, door if level == 0 else None)
        wall.door_m = width_m / 2 if shop else door
        if not shop:
            self._add_door(wall, door)
        self._add_details(wall, width_m, floors)
        return self._finished(wall)

    def side(self, width_m: float, floors: int) -> Wall:
        wall = self._bare(width_m, floors)
        for level in range(floors):
            if level or self._plan.random() < .8:
                self._add_windows(wall, width_m, level, None)
        self._add_details(wall, width_m, floors)
        return self._finished(wall)

    def gable(self, width_m: float, height_m: float) -> Wall:
        """What is below a pointed roof."""
        wall = self._bare(width_m, height_m / FLOOR_M)
        if height_m > 2.2:
            middle, size = width_m / 2, self._window_m[0] * .8
            self._add_window(wall, middle - size / 2, .5, middle + size / 2, .5 + size)
        return self._finished(wall)

    def _bare(self, width_m: float, floors: float) -> Wall:
        height, width = max(8, int(floors * FLOOR_M * PIXELS_PER_METRE)), max(8, int(width_m * PIXELS_PER_METRE))
        weather = strong(fractal(height, width, self._noise, 7))
        streaks = strong(np.repeat(fractal(8, width, self._noise, 7)[4:5], height, 0))
        rgb = self._base * (.5 + .5 * weather + .3 * streaks)[..., None]
        rgb *= 1 + .1 * self._noise.standard_normal((height, width, 1))
        getattr(self, f'_add_{self._style}')(rgb)
        return Wall(rgb)

    def _add_plaster(self, rgb: Array) -> None:
        for _ in range(rgb.shape[1] // 25 + 2):
            top, left = self._noise.integers(0, rgb.shape[0]), self._noise.integers(0, rgb.shape[1])
            height, width = self._noise.integers(6, 50, 2)
            rgb[top:top + height, left:left + width] *= self._noise.uniform(.6, 1.3)

    def _add_brick(self, rgb: Array) -> None:
        rows, cols = math.ceil(rgb.shape[0] / 5), math.ceil(rgb.shape[1] / 10) + 1
        tone = np.kron(self._noise.uniform(.5, 1.4, (rows, cols)), np.ones((5, 10)))
        for row in range(1, rows, 2):
            tone[row * 5:row * 5 + 5] = np.roll(tone[row * 5:row * 5 + 5], 5, 1)
        rgb *= tone[:rgb.shape[0], :rgb.shape[1], None] * np.array([1, .82, .75])
        rgb[::5] = rgb[::5] * .6 + .12

    def _add_timber(self, rgb: Array) -> None:
        beam = np.array([.09, .05, .03])
        height, width = rgb.shape[:2]
        floor = int(FLOOR_M * PIXELS_PER_METRE)
        for level in range(0, height, floor):
            rgb[level:level + 7] = beam
        columns = np.arange(0, width, int(self._plan.uniform(.9, 1.5) * PIXELS_PER_METRE))
        for left in columns:
            rgb[:, left:left + 6] = beam
        rows = np.arange(height)
        for left in columns:
            if self._plan.random() < .4:
                diagonal = left + ((rows % floor) * self._plan.choice([.4, .7])).astype(int)
                for thick in range(6):
                    keep = diagonal + thick < width
                    rgb[rows[keep], diagonal[keep] + thick] = beam

    def _add_panel(self, rgb: Array) -> None:
        width = int(self._plan.uniform(.15, .5) * PIXELS_PER_METRE)
        boards = np.repeat(self._noise.uniform(.8, 1.2, math.ceil(rgb.shape[1] / width)), width)[:rgb.shape[1]]
        rgb *= boards[None, :, None] ** 2
        rgb[:, ::width] *= .45

    def _add_windows(self, wall: Wall, width_m: float, level: int, door_m: float) -> None:
        size, sill = self._window_m, level * FLOOR_M + .95
        count = max(1, int((width_m - .8) / self._pitch_m))
        for k in range(count):
            middle = width_m * (k + .5) / count + self._plan.uniform(-.12, .12)
            if self._plan.random() < .08 or (door_m is not None and abs(middle - door_m) < 1.3):
                continue
            self._add_window(wall, middle - size[0] / 2, sill, middle + size[0] / 2, sill + size[1])

    def _add_window(self, wall: Wall, left: float, bottom: float, right: float, top: float) -> None:
        """Frame, glass, bars, sometimes a blind, a curtain, shutters, flowers; dirt below the sill."""
        plan, rgb = self._plan, wall.rgb
        box_of(rgb, left - .25, bottom - .9, right + .25, bottom)[:] *= plan.uniform(.8, 1)
        box_of(rgb, left - .1, bottom - .1, right + .1, top + .1)[:] = self._frame
        glass = box_of(rgb, left, bottom, right, top)
        if not glass.size:
            return
        reflection = fractal(*glass.shape[:2], self._noise, 4)[..., None]
        glass[:] = plan.uniform(.02, .1) + .22 * reflection ** 2 * np.array([.9, 1, 1.15])
        if plan.random() < .5:
            shade, drawn = plan.uniform(.3, .8), int(plan.uniform(.15, .8) * len(glass))
            glass[:drawn] = shade * (1 - .25 * (np.arange(drawn) % 4 == 0))[:, None, None]
        elif plan.random() < .5:
            fold = max(2, glass.shape[1] // 5)
            cloth = plan.uniform(.4, .8) * (.75 + .25 * np.sin(np.arange(fold) * 1.3))[None, :, None]
            glass[:, :fold], glass[:, -fold:] = cloth, cloth
        for pane in range(1, self._panes):
            bar = left + (right - left) * pane / self._panes
            box_of(rgb, bar - .04, bottom, bar + .04, top)[:] = self._frame
        box_of(rgb, left, top - .42, right, top - .36)[:] = self._frame
        box_of(rgb, left - .15, bottom - .16, right + .15, bottom - .08)[:] = .55
        if self._shutters is not None:
            for a, b in ((left - .55, left - .1), (right + .1, right + .55)):
                panel = box_of(rgb, a, bottom, b, top)
                panel[:] = self._shutters * (.75 + .4 * (np.arange(len(panel)) % 5 > 1))[:, None, None]
        if plan.random() < .2:
            flowers = box_of(rgb, left, bottom - .1, right, bottom + .22)
            flowers[:] = (self._noise.random((*flowers.shape[:2], 1)) > .5) * np.array(plan.choice(_PAINTS)) * 1.5 + .03
        wall.windows.append((left, bottom, right, top))

    def _add_door(self, wall: Wall, middle: float) -> None:
        plan, rgb = self._plan, wall.rgb
        box_of(rgb, middle - .75, 0, middle + .75, 2.35)[:] = self._frame * .9
        leaf = box_of(rgb, middle - .55, 0, middle + .55, 2.15)
        leaf[:] = np.array(plan.choice(_PAINTS)) * (.8 + .4 * self._noise.random((1, leaf.shape[1], 1)))
        box_of(rgb, middle - .35, 1.2, middle + .35, 1.95)[:] = plan.uniform(.03, .3)
        box_of(rgb, middle - .35, .25, middle + .35, 1.0)[:] *= .6
        box_of(rgb, middle + .38, .95, middle + .46, 1.1)[:] = .7
        number = box_of(rgb, middle + .85, 1.5, middle + 1.3, 1.85)
        number[:] = .75 * (1 - glyphs(*number.shape[:2], self._noise)) + .03
        box_of(rgb, middle + .85, 1.0, middle + 1.25, 1.3)[:] = np.array(plan.choice(_PAINTS)) * 1.2

    def _add_shop(self, wall: Wall, width_m: float) -> None:
        plan, rgb = self._plan, wall.rgb
        sign = box_of(rgb, .3, 2.15, width_m - .3, 2.75)
        ink, paper = np.array(plan.choice(_PAINTS)), plan.uniform(.5, .85)
        mask = glyphs(*sign.shape[:2], self._noise)
        sign[:] = mask * ink + (1 - mask) * paper if plan.random() < .5 else mask * paper + (1 - mask) * ink
        left = .4
        while left < width_m - 1.2:
            right = min(width_m - .3, left + plan.uniform(1.1, 2.2))
            glass = box_of(rgb, left, .35, right - .12, 2.1)
            goods = fractal(*glass.shape[:2], self._noise, 5)[..., None]
            glass[:] = .03 + .12 * goods
            for _ in range(6):
                at, up = plan.uniform(left, right - .5), plan.uniform(.4, 1.5)
                item = box_of(rgb, at, up, min(right - .15, at + plan.uniform(.2, .6)), up + plan.uniform(.2, .5))
                item[:] = np.array(plan.choice(_PAINTS)) * plan.uniform(.7, 2)
            wall.windows.append((left, .35, right - .12, 2.1))
            left = right
        box_of(rgb, width_m * .5 - .5, 0, width_m * .5 + .5, 2.1)[:] *= .5

    def _add_details(self, wall: Wall, width_m: float, floors: float) -> None:
        """Plinth, downpipe, vents, posters, cables, ivy."""
        plan, rgb, noise = self._plan, wall.rgb, self._noise
        plinth = box_of(rgb, 0, 0, width_m, .35)
        plinth[:] = plan.uniform(.12, .35) * (.7 + .6 * noise.random((*plinth.shape[:2], 1)))
        pipe = plan.choice([.1, width_m - .25])
        box_of(rgb, pipe, 0, pipe + .12, floors * FLOOR_M)[:] *= .45
        box_of(rgb, pipe + .04, 0, pipe + .07, floors * FLOOR_M)[:] *= 1.9
        for _ in range(plan.randint(2, 5)):
            at, up = plan.uniform(.3, max(.4, width_m - 1.2)), plan.uniform(.5, 1.9)
            note = box_of(rgb, at, up, at + plan.uniform(.25, .8), up + plan.uniform(.25, .6))
            mask = glyphs(*note.shape[:2], noise) if note.size else 0
            note[:] = mask * noise.random(3) * .5 + (1 - mask) * (.3 + .6 * noise.random(3))
        if plan.random() < .3:
            self._add_ivy(rgb)

    def _add_ivy(self, rgb: Array) -> None:
        height, width = rgb.shape[:2]
        left, spread = self._plan.uniform(0, width), self._plan.uniform(40, 110)
        distance = np.abs(np.arange(width) - left)[None] + (height - np.arange(height))[:, None] * .35
        mask = distance + 130 * fractal(height, width, self._noise, 6) < spread + 75
        leaves = self._noise.random((height, width, 1)) ** 2
        rgb[mask] = (leaves * np.array([.12, .3, .06]) + .015)[mask]

    @staticmethod
    def _finished(wall: Wall) -> Wall:
        wall.rgb = wall.rgb.clip(0, 1).astype(np.float32)
        return wall


def roof_tiles(noise: np.random.Generator, rgb: Tuple[float, float, float]) -> Array:
    size, tile = 256, 8
    tone = np.kron(noise.uniform(.65, 1.3, (size // tile, size // tile)), np.ones((tile, tile)))
    tone *= .6 + .8 * fractal(size, size, noise, 5)
    tone[::tile] *= .4
    tone[1::tile] *= .7
    tone[:, ::tile] *= .75
    return (np.array(rgb) * tone[..., None]).clip(0, 1).astype(np.float32)


def stones(noise: np.random.Generator) -> Array:
    rgb = np.full((64, 256, 3), .12)
    for top in range(0, 64, 11):
        left = -int(noise.integers(0, 12))
        while left < 256:
            width = int(noise.integers(9, 24))
            rgb[top + 1:top + 10, max(0, left + 1):left + width] = noise.uniform(.18, .55) * np.array([1, .95, .86])
            left += width + 1
    return (rgb * (.7 + .6 * fractal(64, 256, noise, 7))[..., None]).clip(0, 1).astype(np.float32)


def hedge(noise: np.random.Generator) -> Array:
    shade = fractal(64, 256, noise, 7) * noise.random((64, 256)) ** 1.5 * 2.2
    return (shade[..., None] * np.array([.1, .24, .05]) + .008).clip(0, 1).astype(np.float32)


def slabs(noise: np.random.Generator) -> Array:
    tone = np.kron(noise.uniform(.75, 1.15, (40, 5)), np.ones((13, 13)))[:512, :64]
    tone[::13] *= .55
    tone[:, ::13] *= .55
    tone *= .6 + .8 * fractal(512, 64, noise, 7)
    for _ in range(10):
        row, col = noise.integers(0, 505), noise.integers(0, 58)
        tone[row:row + noise.integers(2, 9), col:col + noise.integers(2, 9)] *= .5
    return (tone[..., None] * np.array([.36, .35, .33])).clip(0, 1).astype(np.float32)


def placard(noise: np.random.Generator, size: Tuple[int, int] = (48, 64)) -> Array:
    """A sign, a poster or a number plate: writing in one colour on another."""
    mask = glyphs(*size, noise)
    ink, paper = noise.random(3) * .35, .4 + .5 * noise.random(3)
    return (mask * ink + (1 - mask) * paper).astype(np.float32)
