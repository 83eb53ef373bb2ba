"""What lies on the ground of a town: the relief, asphalt and pavements, kerbs, lamps and street furniture."""
import math
import random
from typing import List, Tuple

import bpy
import numpy as np

from worlds import meshes
from worlds.batch import Batch
from worlds.course import Relief
from worlds.houses import Site
from worlds.textures import fractal
from worlds.town_course import TownPlan
from worlds.town_textures import placard, slabs, strong

CARRIAGEWAY_M = 3.2  # from the middle to the parked cars
KERB_M = 5.3
FENCE_M = 7.2
JUNCTION_M = 8.6  # kerbs end so far before the middle of a junction
_PIXELS = 3072

Side = Tuple[np.ndarray, np.ndarray, np.ndarray, float]  # start, along, outwards, length


def sides(plan: TownPlan) -> List[Tuple[Tuple[str, str], int, Side]]:
    """Both sides of every street, seen along the street in the unturned grid: 1 is its left."""
    result = []
    for a, b in plan.streets:
        start, end = np.array(plan.nodes[a]), np.array(plan.nodes[b])
        length = float(np.linalg.norm(end - start))
        along = (end - start) / length
        left = np.array([-along[1], along[0]]) * (-1 if plan.mirrored else 1)
        for sign in (1, -1):
            result.append(((a, b), sign, (start, along, left * sign, length)))
    return result


def terrain(batch: Batch, relief: Relief, material: 'bpy.types.Material', reach_m: float, step_m: float,
            sunk_m: float = 0) -> None:
    """The ground as a net of squares."""
    count = int(2 * reach_m / step_m)
    axis = np.linspace(-reach_m, reach_m, count + 1)
    x, y = np.meshgrid(axis, axis)
    net = np.stack([x, y, relief.height(x, y) - sunk_m], -1)
    uv = np.stack([(x + reach_m) / 2 / reach_m, (y + reach_m) / 2 / reach_m], -1)
    squares = [np.stack([part[:-1, :-1], part[:-1, 1:], part[1:, 1:], part[1:, :-1]], 2) for part in (net, uv)]
    batch.faces(squares[0].reshape(-1, 4, 3), material, squares[1].reshape(-1, 4, 2))


def ground_map(plan: TownPlan, reach_m: float, rng: random.Random, noise: np.random.Generator) -> np.ndarray:
    """The town seen from above: lawns, asphalt with patches and cracks, gutters, lines, crossings."""
    axis = np.linspace(-reach_m, reach_m, _PIXELS, dtype=np.float32)
    patches = fractal(_PIXELS, _PIXELS, noise, 8).astype(np.float32)
    speckle = noise.random((_PIXELS, _PIXELS), dtype=np.float32)
    rgb = (np.array([.16, .23, .07], np.float32) * (.35 + .6 * patches + .5 * speckle)[..., None])
    rgb[patches > .57] = (np.array([.25, .2, .13]) * (.5 + speckle[..., None]))[patches > .57]
    asphalt = (.05 + .16 * strong(patches) + .08 * speckle)[..., None] * np.array([1, 1, 1.03], np.float32)
    views = [_Street(plan, a, b, axis) for a, b in plan.streets]
    for street in views:
        on = street.distance < KERB_M
        street.part(rgb)[on] = street.part(asphalt)[on]
    for name, (x, y) in plan.nodes.items():
        rows, cols = _window(axis, y, 11), _window(axis, x, 11)
        crossing = sum(name in street for street in plan.streets) == 4
        on = np.hypot(axis[cols][None] - x, axis[rows][:, None] - y) < (8.8 if crossing else 7.4)
        rgb[rows, cols][on] = asphalt[rows, cols][on]
    for street in views:
        street.paint(rgb, rng, noise)
    return rgb[::-1].clip(0, 1)


def _window(axis: np.ndarray, middle: float, half: float) -> slice:
    return slice(*np.searchsorted(axis, (middle - half, middle + half)))


class _Street:
    """The pixels around one street: distance to its middle line and way along it."""

    def __init__(self, plan: TownPlan, a: str, b: str, axis: np.ndarray):
        start, end = np.array(plan.nodes[a]), np.array(plan.nodes[b])
        middle, half = (start + end) / 2, np.abs(end - start) / 2 + 12
        self._rows, self._cols = _window(axis, middle[1], half[1]), _window(axis, middle[0], half[0])
        self._length = float(np.linalg.norm(end - start))
        along = (end - start) / self._length
        dx, dy = axis[self._cols][None] - start[0], axis[self._rows][:, None] - start[1]
        self._s = dx * along[0] + dy * along[1]
        self._aside = -dx * along[1] + dy * along[0]
        beyond = np.maximum(0, np.maximum(-self._s, self._s - self._length))
        self.distance = np.hypot(self._aside, beyond)

    def part(self, rgb: np.ndarray) -> np.ndarray:
        """The street's window of the map."""
        return rgb[self._rows, self._cols]

    def paint(self, rgb: np.ndarray, rng: random.Random, noise: np.random.Generator) -> None:
        """Lines, crossings, repairs, cracks, manholes."""
        part, s, aside = self.part(rgb), self._s, np.abs(self._aside)
        inside = (s > JUNCTION_M) & (s < self._length - JUNCTION_M)
        bay = inside & (aside > CARRIAGEWAY_M) & (aside < KERB_M)
        part[bay] = part[bay] * np.array([1.5, 1.4, 1.3]) * (.8 + .25 * ((s[bay] * 2.5).astype(int) % 2))[:, None]
        part[inside & (np.abs(aside - CARRIAGEWAY_M) < .09)] = .5
        for _ in range(7):
            at, out = rng.uniform(5, self._length - 5), rng.uniform(-3, 3)
            size, tone = (rng.uniform(.5, 3.5), rng.uniform(.3, 1.2)), rng.choice([.55, .7, 1.35, 1.6])
            part[(np.abs(s - at) < size[0]) & (np.abs(self._aside - out) < size[1])] *= tone
        for _ in range(4):
            at, out = rng.uniform(5, self._length - 5), rng.uniform(-2.5, 2.5)
            away = np.hypot(s - at, self._aside - out)
            part[away < .42] = .05
            part[(away < .42) & (((s * 9).astype(int) + (self._aside * 9).astype(int)) % 2 == 0)] = .2
        for _ in range(5):
            at, out, wave = rng.uniform(0, self._length), rng.uniform(-3, 3), rng.uniform(.2, .9)
            crack = np.abs(self._aside - out - wave * np.sin(s * rng.uniform(.5, 2))) < .07
            part[crack & (np.abs(s - at) < 7)] *= .3
        worn = .35 + .5 * noise.random(s.shape)[..., None]
        line = inside & (aside < .09) & (s % 4 < 2.2)
        part[line] = worn[line]
        for end in (JUNCTION_M + 2, self._length - JUNCTION_M - 2):
            if rng.random() < .45:
                bars = (np.abs(s - end) < 1.6) & (aside < CARRIAGEWAY_M) & (self._aside % 1 < .5)
                part[bars] = worn[bars]
            elif rng.random() < .6:
                bar = (np.abs(s - end) < .25) & (aside < CARRIAGEWAY_M)
                part[bar] = worn[bar]


def ground_material(rgb: np.ndarray, wet: bool) -> 'bpy.types.Material':
    """The map from above times fine grain; wet ground is darker and mirrors."""
    material = meshes.image_material(rgb, 'ground', 1.0)
    tree = material.node_tree
    surface, texture = tree.nodes['Principled BSDF'], tree.nodes['Image Texture']
    grain, where = tree.nodes.new('ShaderNodeTexNoise'), tree.nodes.new('ShaderNodeTexCoord')
    grain.inputs['Scale'].default_value = 4.5
    grain.inputs['Detail'].default_value = 9
    grain.inputs['Roughness'].default_value = .85
    tree.links.new(where.outputs['Object'], grain.inputs['Vector'])
    contrast = tree.nodes.new('ShaderNodeMapRange')
    contrast.inputs['From Min'].default_value, contrast.inputs['From Max'].default_value = .41, .59
    low, high = (.08, .85) if wet else (.25, 1.75)
    contrast.inputs['To Min'].default_value, contrast.inputs['To Max'].default_value = low, high
    tree.links.new(grain.outputs['Fac'], contrast.inputs['Value'])
    product = tree.nodes.new('ShaderNodeVectorMath')
    product.operation = 'MULTIPLY'
    tree.links.new(texture.outputs['Color'], product.inputs[0])
    tree.links.new(contrast.outputs['Result'], product.inputs[1])
    tree.links.new(product.outputs['Vector'], surface.inputs['Base Color'])
    if wet:
        puddles = tree.nodes.new('ShaderNodeMapRange')
        puddles.inputs['From Min'].default_value, puddles.inputs['From Max'].default_value = .44, .58
        puddles.inputs['To Min'].default_value, puddles.inputs['To Max'].default_value = .06, .5
        tree.links.new(grain.outputs['Fac'], puddles.inputs['Value'])
        tree.links.new(puddles.outputs['Result'], surface.inputs['Roughness'])
        surface.inputs['Specular'].default_value = .6
    return material


class Pavements:
    """Kerbs and slabs along every street."""

    def __init__(self, batch: Batch, plan: TownPlan, noise: np.random.Generator, wet: bool):
        self._batch, self._relief = batch, plan.relief
        self._kerb = meshes.flat_material((.42, .41, .39), 'kerb', .3 if wet else .9)
        self._slabs = []
        for _ in range(6):
            tone = slabs(noise) * (.6 if wet else 1)
            self._slabs.append(meshes.image_material(tone, 'slabs', .25 if wet else .95))

    def add(self, side: Side, rng: random.Random) -> None:
        """One side of a street."""
        start, along, out, length = side
        material, shift = rng.choice(self._slabs), rng.random()
        stations = np.append(np.arange(JUNCTION_M, length - JUNCTION_M, 2.0), length - JUNCTION_M)
        for s, after in zip(stations[:-1], stations[1:]):
            ring = [(s, KERB_M), (after, KERB_M), (after, FENCE_M + .3), (s, FENCE_M + .3)]
            lower, upper = ([self._point(start + u * along + v * out, lift) for u, v in ring] for lift in (-.1, .12))
            self._batch.prism(lower, upper, self._kerb)
            self._batch.quad([(x, y, z + .006) for x, y, z in (upper[0], upper[3], upper[2], upper[1])], material,
                             (0, shift + s / 12.8, 1.35, shift + after / 12.8))
            self._batch.quad([(x, y, z + .012) for x, y, z in (
                upper[0], upper[1], self._point(start + after * along + (KERB_M + .16) * out, .12),
                self._point(start + s * along + (KERB_M + .16) * out, .12))], self._kerb)

    def corner(self, node: np.ndarray, first: np.ndarray, second: np.ndarray) -> List[np.ndarray]:
        """The round corner between two streets that leave a junction, `second` left of `first`; returns its fence."""
        normals = np.array([-first[1], first[0]]), np.array([second[1], -second[0]])
        ends = [node + JUNCTION_M * along for along in (first, second)]
        lines = {}
        for out in (KERB_M, FENCE_M + .3):
            a, b = (end + out * normal for end, normal in zip(ends, normals))
            cross = first[0] * second[1] - first[1] * second[0]
            middle = (a + b) / 2
            if abs(cross) > .5:
                gap = b - a
                middle = a + first * (gap[0] * second[1] - gap[1] * second[0]) / cross
            lines[out] = a, middle, b
        share = np.linspace(0, 1, 9)[:, None]
        a, middle, b = lines[KERB_M]
        kerb = (1 - share) ** 2 * a + 2 * share * (1 - share) * middle + share ** 2 * b
        a, middle, b = lines[FENCE_M + .3]
        fence = np.where(share < .5, a + (middle - a) * 2 * share, middle + (b - middle) * (2 * share - 1))
        for k in range(8):
            ring = [kerb[k], kerb[k + 1], fence[k + 1], fence[k]]
            lower, upper = ([self._point(point, lift) for point in ring] for lift in (-.1, .12))
            self._batch.prism(lower, upper, self._kerb)
            self._batch.quad([(x, y, z + .006) for x, y, z in (upper[0], upper[3], upper[2], upper[1])], self._slabs[0],
                             (0, .1 * k, 1.35, .1 * k + .08))
        return [fence[0], fence[4], fence[8]]

    def _point(self, place: np.ndarray, lift: float) -> Tuple[float, float, float]:
        return float(place[0]), float(place[1]), float(self._relief.height(*place)) + lift


class Furniture:
    """Lamps, signs, bins and boxes on the pavements."""

    def __init__(self, batch: Batch, plan: TownPlan, rng: random.Random, noise: np.random.Generator):
        self._batch, self._relief, self._rng, self._noise = batch, plan.relief, rng, noise
        self._pole = meshes.flat_material((.2, .22, .22), 'pole', .5)
        self._glow = meshes.flat_material((.8, .78, .7), 'glow')
        self._glow.cycles.sample_as_light = False  # add_lamps does it with less noise
        self._bollard = meshes.flat_material((.5, .12, .06), 'bollard')
        self._bin = meshes.flat_material((.05, .12, .07), 'bin', .5)
        self.lamps: List[Tuple[float, float, float]] = []

    def glow(self, strength: float) -> None:
        surface = self._glow.node_tree.nodes['Principled BSDF']
        surface.inputs['Emission'].default_value = (1, .78, .48, 1)
        surface.inputs['Emission Strength'].default_value = strength

    def lamp(self, site: Site) -> None:
        x, y, _ = site.at(0, 0)
        z = float(self._relief.height(x, y))
        self._batch.cylinder((x, y, z), (x, y, z + 5), .075, self._pole, 7, .05)
        tip = site.at(0, -1.6, z + 5.25)
        self._batch.cylinder((x, y, z + 5), tip, .045, self._pole, 5)
        head = math.atan2(site.back[1], site.back[0])
        self._batch.box((tip[0], tip[1], tip[2] - .02), (.75, .3, .12), head, self._pole)
        self._batch.box((tip[0], tip[1], tip[2] - .07), (.6, .24, .05), head, self._glow)
        self.lamps.append((tip[0], tip[1], tip[2] - .2))
        if self._rng.random() < .5:
            self._plate(site, z + 2.0, .5)

    def sign(self, site: Site) -> None:
        x, y, _ = site.at(0, 0)
        z = float(self._relief.height(x, y))
        self._batch.cylinder((x, y, z), (x, y, z + 2.7), .035, self._pole, 6)
        self._plate(site, z + 1.9, .65)
        if self._rng.random() < .4:
            self._plate(site, z + 1.45, .35)

    def _plate(self, site: Site, bottom: float, height: float) -> None:
        """Writing towards both directions of the street."""
        size = (max(12, int(height * 64)), 44)
        for side in (-.05, .05):
            writing = meshes.image_material(placard(self._noise, size), 'plate', .5)
            a, b = ((-.35, .35) if side < 0 else (.35, -.35))
            self._batch.quad([site.at(side, a, bottom), site.at(side, b, bottom), site.at(side, b, bottom + height),
                              site.at(side, a, bottom + height)], writing)

    def clutter(self, site: Site) -> None:
        x, y, _ = site.at(0, 0)
        z = float(self._relief.height(x, y)) + .1
        yaw, kind = math.atan2(site.along[1], site.along[0]), self._rng.random()
        if kind < .35:
            self._batch.cylinder((x, y, z), (x, y, z + .95), .24, self._bin, 9, .28)
        elif kind < .7:
            cabinet = meshes.image_material(placard(self._noise, (72, 64)), 'cabinet')
            self._batch.box((x, y, z), (1.0, .4, 1.25), yaw, cabinet)
        else:
            for k in range(4):
                px, py, _ = site.at(1.3 * k, 0)
                pz = float(self._relief.height(px, py))
                self._batch.cylinder((px, py, pz), (px, py, pz + .95), .06, self._bollard, 7)
