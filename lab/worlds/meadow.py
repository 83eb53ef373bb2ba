"""Builds the meadow in Blender: grass, hedges and trees that the wind of a round moves, few houses at the edge."""
import math
import random

import bpy
import numpy as np

from worlds import lights, meshes, textures
from worlds.batch import Batch
from worlds.course import HillyDrive
from worlds.fences import Fences
from worlds.houses import House, Site
from worlds.meadow_course import MeadowPlan, meadow_drive
from worlds.plants import Planter, bent
from worlds.spec import Spec
from worlds.streets import ground_material, terrain
from worlds.textures import fractal
from worlds.town_textures import roof_tiles, strong

REACH_M = 75.0
FREE_M = 2.6  # of trees and hedges beside the path
GRASS = 170000
_PIXELS = 2048


class Meadow:
    """The meadow of a seed. `noise` and `plan` decide what grows, `wind` how it bends in this round."""

    def __init__(self, scene: 'bpy.types.Scene', plan: MeadowPlan, spec: Spec):
        self._scene, self._plan = scene, plan
        self._rng = random.Random(f'meadow plants {spec.seed}')
        self._noise = np.random.default_rng([spec.seed, 4])
        days = ('sunny', 'overcast')
        self._wind = np.random.default_rng([spec.seed, 5, days.index(spec.day), abs(spec.round)])
        self._batch = Batch()
        self._planter = Planter(self._batch, self._noise, self._wind)
        s = np.arange(0, plan.path.length_m, .25)
        self._farm = 0.0
        self._path = np.stack(plan.path.point(s), 1)

    def build(self) -> None:
        self._add_ground()
        self._add_hedges()
        self._add_trees()
        self._add_grass()
        self._add_houses()
        self._add_skyline()
        self._batch.build(self._scene)

    def _height(self, x, y):
        return self._plan.relief.height(x, y)

    def _from_path(self, points: np.ndarray) -> np.ndarray:
        return np.concatenate([np.sqrt(((part[:, None] - self._path[None]) ** 2).sum(2).min(1))
                               for part in np.array_split(points, max(1, len(points) // 500))])

    def _add_ground(self) -> None:
        axis = np.linspace(-REACH_M, REACH_M, _PIXELS, dtype=np.float32)
        patches = strong(fractal(_PIXELS, _PIXELS, self._noise, 8))
        speckle = self._noise.random((_PIXELS, _PIXELS))
        rgb = np.array([.17, .24, .06]) * (.3 + .5 * patches + .6 * speckle)[..., None]
        rgb += (patches > .75)[..., None] * np.array([.1, .06, .02])
        earth = np.array([.26, .2, .13]) * (.35 + .5 * patches + .5 * speckle)[..., None]
        for x, y in self._path:
            rows, cols = (slice(*np.searchsorted(axis, (middle - 1.2, middle + 1.2))) for middle in (y, x))
            away = np.hypot(axis[cols][None] - x, axis[rows][:, None] - y)
            trodden = away + .8 * (patches[rows, cols] - .5) < .75
            rgb[rows, cols][trodden] = earth[rows, cols][trodden]
        terrain(self._batch, self._plan.relief, ground_material(rgb[::-1].clip(0, 1), False), REACH_M, 1)
        far = meshes.image_material(textures.wood(self._noise) * 1.4, 'far', 1.0)
        terrain(self._batch, self._plan.relief, far, 400, 10, .5)

    def _add_hedges(self) -> None:
        """Long ones along the path and across the meadow, and a fence."""
        rng, path = self._rng, self._plan.path
        fences = Fences(self._batch, self._plan.relief, self._planter, self._noise)
        for k in range(14):
            s, side, out = rng.uniform(0, path.length_m), rng.choice([-1, 1]), rng.uniform(3.2, 9)
            for piece in range(rng.randint(3, 7)):
                points = []
                for along in (s + 3 * piece, s + 3 * piece + 3):
                    x, y, heading = path.at(along)
                    points.append((x - side * out * math.sin(heading), y + side * out * math.cos(heading)))
                if self._from_path(np.array(points)).min() < FREE_M or math.dist(*points) < .5:
                    continue
                if k < 11:
                    self._planter.hedge(*points, (rng.uniform(.7, 1.2), rng.uniform(.8, 2.2)), self._plan.relief, rng)
                else:
                    fences.add('picket', *np.array(points), rng)

    def _add_trees(self) -> None:
        rng = self._rng
        for _ in range(230):
            point = np.array([rng.uniform(-REACH_M, REACH_M) for _ in range(2)])
            away = float(self._from_path(point[None])[0])
            if away < FREE_M or (away > 12 and rng.random() < .35):
                continue
            foot = (*point, float(self._height(*point)))
            self._planter.any_plant(foot, rng, (.4, (.9, 1.9)), (.15, (.6, 1.4)), (.7, 1.8))

    def _add_grass(self) -> None:
        """Blades of one triangle: dense beside the path, thin further out, none where people tread."""
        noise = self._noise
        where = self._path[noise.integers(0, len(self._path), GRASS)] + noise.normal(0, 3.2, (GRASS, 2))
        where = where[self._from_path(where) > .85]
        clumps = fractal(256, 256, noise, 6)
        cells = ((where / REACH_M + 1) * 128).astype(int).clip(0, 255)
        where = where[clumps[cells[:, 1], cells[:, 0]] > noise.normal(.48, .05, len(where))]
        feet = np.column_stack([where, self._height(where[:, 0], where[:, 1]) - .02])
        heights = noise.gamma(6, .035, (len(feet), 1))
        lean = noise.normal(0, .3, (len(feet), 2)) * heights
        tips = feet + np.column_stack([lean, heights])
        tips = bent(tips, heights, self._wind)
        turn = noise.uniform(0, 2 * math.pi, len(feet))
        half = np.column_stack([np.cos(turn), np.sin(turn), 0 * turn]) * .014
        uvs = np.broadcast_to(np.array([(0, 0), (.1, 0), (.05, .1)]), (len(feet), 3, 2)) + .9 * noise.random(
            (len(feet), 1, 2))
        kinds = noise.integers(0, 3, len(feet))
        for kind, material in enumerate(self._planter.blades()):
            on = kinds == kind
            self._batch.faces(np.stack([feet - half, feet + half, tips], 1)[on], material, uvs[on])

    def _add_houses(self) -> None:
        roofs = [meshes.image_material(roof_tiles(self._noise, (.36, .13, .07)), 'roof', .9)]
        stone = meshes.flat_material((.2, .19, .17), 'plinth', .95)
        self._farm = self._rng.uniform(.2, 4.6)  # the direction of its first house
        for k in range(4):
            angle = self._farm + .2 + .3 * k
            house, out = House(self._rng, self._noise, roofs, stone), (math.cos(angle), math.sin(angle))
            site = Site((58 * out[0], 58 * out[1]), (-out[1], out[0]), out)
            corners = [site.at(u * house.width_m / 2, v * house.depth_m)[:2] for u in (-1, 1) for v in (0, 1)]
            house.add(self._batch, site, [float(self._height(*corner)) for corner in corners])

    def _add_skyline(self) -> None:
        """The edge of a wood, and more wood behind it."""
        for k in range(150):
            angle, distance = 2 * math.pi * k / 150 + self._rng.uniform(-.03, .03), self._rng.uniform(66, 92)
            if self._farm < angle % (2 * math.pi) < self._farm + 1.3:
                continue
            x, y = distance * math.cos(angle), distance * math.sin(angle)
            plant = self._planter.conifer if self._rng.random() < .6 else self._planter.tree
            plant((x, y, float(self._height(x, y))), self._rng, self._rng.uniform(1.1, 2))
        for k in range(30):
            angle, distance = 2 * math.pi * k / 30 + self._rng.uniform(-.05, .05), self._rng.uniform(95, 140)
            x, y, width = distance * math.cos(angle), distance * math.sin(angle), self._rng.uniform(16, 34)
            tx, ty = -math.sin(angle) * width / 2, math.cos(angle) * width / 2
            low, height = float(self._height(x, y)) - 2, self._rng.uniform(6, 9)
            material = meshes.image_material(textures.wood(self._noise), 'wood', 1.0)
            self._batch.quad([(x - tx, y - ty, low), (x + tx, y + ty, low), (x + tx, y + ty, low + height),
                              (x - tx, y - ty, low + height)], material)


def build(scene: 'bpy.types.Scene', spec: Spec) -> HillyDrive:
    plan = MeadowPlan(spec.seed)
    Meadow(scene, plan, spec).build()
    rng = random.Random(f'meadow sky {spec.seed} {spec.day} {spec.round}')
    if spec.day == 'sunny':
        lights.add_clear_sky(scene, rng.uniform(30, 50), rng.uniform(0, 360), .35, .12)
        lights.add_clouds(scene, .35, 9, rng.randrange(1000))
    else:
        lights.add_overcast_sky(scene, .8, rng.uniform(0, 6.28))
        lights.add_clouds(scene, .55, .45, rng.randrange(1000))
    return meadow_drive(plan, spec)
