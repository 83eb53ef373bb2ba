"""Builds the town in Blender: houses in rows, two of which are twins, gardens, streets, and what changes by day."""
import math
import random
from typing import Dict, List, NamedTuple, Optional, Tuple

import bpy
import numpy as np

from worlds import lights, meshes, streets, textures
from worlds.batch import Batch
from worlds.fences import KINDS, Fences
from worlds.houses import House, Site
from worlds.plants import Planter
from worlds.spec import Spec
from worlds.streets import FENCE_M, JUNCTION_M, Furniture, Pavements, Side
from worlds.town_course import TWIN_ROWS, TownPlan, town_drive
from worlds.town_textures import placard, roof_tiles
from worlds.vehicles import Parking, add_person

REACH_M = 125.0  # of the town around the origin
DESIGNS = 46
_TILES = ((.36, .12, .06), (.3, .16, .1), (.16, .14, .14), (.42, .2, .1), (.2, .09, .07), (.12, .12, .15))


class Lot(NamedTuple):
    """A piece of a row: with or without a house, behind a fence."""

    width_m: float
    house: Optional[House]
    setback_m: float
    fence: str
    tree: float  # where, as a share of the width


class Town:
    """The town of a seed. `plan` and `noise` decide what never changes, `day` the cars and lit windows."""

    def __init__(self, scene: 'bpy.types.Scene', plan: TownPlan, spec: Spec):
        self._scene, self._plan, self._spec = scene, plan, spec
        self._rng = random.Random(f'town houses {spec.seed}')
        self._noise = np.random.default_rng([spec.seed, 1])
        self._day = random.Random(f'town cars {spec.seed} {spec.day}')
        self._round = random.Random(f'town people {spec.seed} {spec.day} {spec.round}')
        self._wet, self._dusk = spec.day == 'wet', spec.day == 'dusk'
        self._batch = Batch()
        self._planter = Planter(self._batch, self._noise)
        self._fences = Fences(self._batch, plan.relief, self._planter, self._noise)
        self._furniture = Furniture(self._batch, plan, self._rng, self._noise)
        self._sides: List[Tuple[Tuple[str, str], int, Side]] = streets.sides(plan)
        self._footprints: List[np.ndarray] = []
        self._lit: List[list] = []

    def build(self) -> List[Tuple[float, float, float]]:
        self._add_ground()
        designs = self._designs()
        self._add_rows(designs)
        self._add_pavements()
        self._add_gardens()
        self._add_cars()
        self._add_people()
        self._add_skyline()
        if self._dusk:
            self._light_windows()
            self._furniture.glow(4)
        self._batch.build(self._scene)
        return self._furniture.lamps

    def _height(self, x: float, y: float) -> float:
        return float(self._plan.relief.height(x, y))

    def _add_ground(self) -> None:
        rgb = streets.ground_map(self._plan, REACH_M, self._rng, self._noise)
        streets.terrain(self._batch, self._plan.relief, streets.ground_material(rgb, self._wet), REACH_M, 1.25)
        far = meshes.image_material(textures.wood(self._noise) * 1.3, 'far', 1.0)
        streets.terrain(self._batch, self._plan.relief, far, 420, 10, .6)

    def _designs(self) -> List[House]:
        roofs = [meshes.image_material(roof_tiles(self._noise, rgb), 'roof', .9) for rgb in _TILES]
        for roof in roofs:
            roof.node_tree.nodes['Image Texture'].extension = 'REPEAT'
        stone = meshes.flat_material((.2, .19, .17), 'plinth', .95)
        return [House(self._rng, self._noise, roofs, stone) for _ in range(DESIGNS)]

    def _row(self, length_m: float, designs: List[House]) -> List[Lot]:
        """Lots one beside the other along a street."""
        rng, lots, used = self._rng, [], 0.0
        while length_m - used > 3:
            house = designs.pop() if designs and rng.random() < .94 else None
            width = house.width_m + rng.uniform(.4, 2) if house else rng.uniform(3, 7)
            if used + width > length_m:
                house, width = None, length_m - used
            fence = 'none' if house and house.is_shop else rng.choice(KINDS)
            lots.append(Lot(width, house, rng.uniform(8.9, 10.2) if fence != 'none' else 8.3, fence, rng.random()))
            used += width
        return lots

    def _add_rows(self, designs: List[House]) -> None:
        """Twin rows first: nothing may be in their way. Then long streets before short ones."""
        twins = [side for street, sign, side in self._sides if street in TWIN_ROWS and sign == 1]
        row = max((self._twin_row(twins, designs) for _ in range(30)),
                  key=lambda lots: sum(lot.house is not None for lot in lots))
        designs = [house for house in designs if house not in [lot.house for lot in row]]
        state = self._rng.getstate()
        for side in twins:
            self._rng.setstate(state)
            self._place_row(side, row)
        others = [side for street, sign, side in self._sides if street not in TWIN_ROWS or sign != 1]
        spare: List[House] = list(designs)
        for side in sorted(others, key=lambda side: -side[3]):
            if len(designs) < 5:
                designs = self._rng.sample(spare, len(spare))
            self._place_row(side, self._row(side[3] - 2 * JUNCTION_M, designs))

    def _twin_row(self, twins: List[Side], designs: List[House]) -> List[Lot]:
        """A row whose houses have room in both streets."""
        row = self._row(min(side[3] for side in twins) - 2 * JUNCTION_M, self._rng.sample(designs, 8))
        return [lot if all(map(self._is_free, outlines)) else lot._replace(house=None)
                for lot, *outlines in zip(row, *(self._outlines(side, row) for side in twins))]

    @staticmethod
    def _sites(side: Side, row: List[Lot]) -> List[Site]:
        start, along, out, _ = side
        ends = JUNCTION_M + np.cumsum([lot.width_m for lot in row])
        return [Site(tuple(start + (end - lot.width_m / 2) * along + lot.setback_m * out), tuple(along), tuple(out))
                for lot, end in zip(row, ends)]

    def _outlines(self, side: Side, row: List[Lot]) -> List[np.ndarray]:
        return [site.outline(lot.house.width_m, lot.house.depth_m) if lot.house else np.full((4, 2), 1e6)
                for lot, site in zip(row, self._sites(side, row))]

    def _place_row(self, side: Side, row: List[Lot]) -> None:
        start, along, out, _ = side
        s = JUNCTION_M
        for lot, site in zip(row, self._sites(side, row)):
            middle = start + (s + lot.width_m / 2) * along
            a, b = (start + (s + d) * along + (FENCE_M + .3) * out for d in (0, lot.width_m))
            if lot.house and self._place_house(lot, site):
                gap = .7 * along
                self._fences.add(lot.fence, a, middle + (FENCE_M + .3) * out - gap, self._rng)
                self._fences.add(lot.fence, middle + (FENCE_M + .3) * out + gap, b, self._rng)
            else:
                fence = lot.fence if lot.fence != 'none' else 'wall'
                self._fences.add(fence, a, b, self._rng)
                self._add_garden_plant(start + (s + lot.tree * lot.width_m) * along + 9.2 * out)
            s += lot.width_m

    def _place_house(self, lot: Lot, site: Site) -> bool:
        """Unless something is in its way."""
        house = lot.house
        corners = site.outline(house.width_m, house.depth_m)
        if not self._is_free(corners):
            return False
        self._footprints.append(corners)
        ground = [self._height(*corner) for corner in corners]
        floor = house.add(self._batch, site, ground)
        if self._dusk:
            self._lit += house.lit_windows(site, floor, self._day, .3)
        return True

    def _is_free(self, corners: np.ndarray) -> bool:
        outline = np.concatenate([corners, (corners + np.roll(corners, 1, 0)) / 2])
        if any(self._street_distance(point) < FENCE_M + .4 for point in outline):
            return False
        return not any(overlap(corners, other) for other in self._footprints)

    def _street_distance(self, point: np.ndarray) -> float:
        nearest = math.inf
        for _, sign, (start, along, _, length) in self._sides:
            if sign > 0:
                s = min(max(float((point - start) @ along), 0), length)
                nearest = min(nearest, float(np.linalg.norm(point - start - s * along)))
        return nearest

    def _add_garden_plant(self, point: np.ndarray) -> None:
        foot = (float(point[0]), float(point[1]), self._height(*point))
        self._planter.any_plant(foot, self._rng, (.45, (.9, 1.5)), (.2, (.6, 1.1)), (.8, 1.6))

    def _add_pavements(self) -> None:
        pavements = Pavements(self._batch, self._plan, self._noise, self._wet)
        self._add_corners(pavements)
        for k, (_, _, side) in enumerate(self._sides):
            pavements.add(side, self._rng)
            start, along, out, length = side
            for s in np.arange(JUNCTION_M + 1 + 9 * (k % 2), length - JUNCTION_M, 18):
                self._furniture.lamp(self._curb_site(side, s, 5.6))
            for s in (JUNCTION_M + .8, length - JUNCTION_M - .8):
                if self._rng.random() < .55:
                    self._furniture.sign(self._curb_site(side, s, 5.7))
            for _ in range(2):
                if self._rng.random() < .7:
                    s = self._rng.uniform(JUNCTION_M + 2, length - JUNCTION_M - 6)
                    self._furniture.clutter(self._curb_site(side, s, 6.85))

    def _add_corners(self, pavements: Pavements) -> None:
        """Round corners of the pavements at every junction, with a fence or a hedge behind."""
        for name, node in self._plan.nodes.items():
            node = np.array(node)
            leaving = []
            for street in self._plan.streets:
                if name in street:
                    other = np.array(self._plan.nodes[street[1 - street.index(name)]])
                    leaving.append((other - node) / np.linalg.norm(other - node))
            leaving.sort(key=lambda along: math.atan2(along[1], along[0]))
            for first, second in zip(leaving, leaving[1:] + leaving[:1]):
                if len(leaving) == 2 and first[0] * second[1] - first[1] * second[0] < 0:
                    self._add_outer_corner(node, second, first)
                a, middle, b = pavements.corner(node, first, second)
                kind = self._rng.choice(['hedge', 'wall', 'picket', 'wall'])
                self._fences.add(kind, a, middle, self._rng)
                self._fences.add(kind, middle, b, self._rng)

    def _add_outer_corner(self, node: np.ndarray, first: np.ndarray, second: np.ndarray) -> None:
        """Trees where a street turns at the edge of the town."""
        outwards = -(first + second) / np.linalg.norm(first + second)
        across = np.array([-outwards[1], outwards[0]])
        for aside in (-9, -5.5, -2, 2, 5.5, 9):
            self._add_garden_plant(node + outwards * self._rng.uniform(12, 15) + aside * across)

    @staticmethod
    def _curb_site(side: Side, s: float, out_m: float) -> Site:
        start, along, out, _ = side
        return Site(tuple(start + s * along + out_m * out), tuple(along), tuple(out))

    def _add_gardens(self) -> None:
        """Trees behind the houses and around the town."""
        for _ in range(1100):
            point = np.array([self._rng.uniform(-REACH_M, REACH_M) for _ in range(2)])
            small = point + np.array([(-1.2, -1.2), (1.2, -1.2), (1.2, 1.2), (-1.2, 1.2)])
            if self._street_distance(point) > 9.4 and not any(overlap(small, other) for other in self._footprints):
                self._add_garden_plant(point)

    def _add_cars(self) -> None:
        """Parked along the kerbs: others on another day. Here and there a tree stands in a bay on every day."""
        parking = Parking(self._batch, self._day, np.random.default_rng([self._spec.seed, 2]), self._height)
        for _, sign, (start, along, out, length) in self._sides:
            full = self._rng.choice([.2, .45, .7])
            for s in np.arange(JUNCTION_M + 5, length - JUNCTION_M - 4.5, 5.6):
                point = start + s * along + 4.3 * out
                if self._rng.random() < .22:
                    self._planter.tree((*point, self._height(*point)), self._rng, self._rng.uniform(1.1, 1.5))
                elif self._day.random() < full:
                    point = point + self._day.uniform(-.4, .4) * along + self._day.uniform(-.12, .1) * out
                    yaw = math.atan2(along[1], along[0]) + (0 if sign < 0 else math.pi)
                    parking.park(*point, yaw + self._day.gauss(0, .03))

    def _add_people(self) -> None:
        for _ in range(16):
            _, _, (start, along, out, length) = self._round.choice(self._sides)
            x, y = start + self._round.uniform(8, length - 8) * along + self._round.uniform(5.7, 6.8) * out
            add_person(self._batch, (x, y, self._height(x, y) + .12),
                       math.atan2(along[1], along[0]) + self._round.choice([0, math.pi]), self._round)

    def _add_skyline(self) -> None:
        """Houses, woods and two towers all around."""
        facades = textures.FacadePainter(self._rng, self._noise)
        for k in range(44):
            angle = 2 * math.pi * k / 44 + self._rng.uniform(-.05, .05)
            distance, width = self._rng.uniform(130, 190), self._rng.uniform(14, 34)
            x, y = distance * math.cos(angle), distance * math.sin(angle)
            tx, ty = -math.sin(angle) * width / 2, math.cos(angle) * width / 2
            height = self._rng.uniform(6, 16)
            if k % 22 == 7:
                tower = meshes.image_material(facades.paint(8, 30, 12), 'tower')
                self._batch.box((x, y, self._height(x, y) - 2), (8, 8, 30), angle, tower)
                self._batch.box((x, y, self._height(x, y) + 28), (9, 9, 13), angle, tower, .02)
                continue
            house = self._rng.random() < .5
            material = meshes.image_material(facades.paint(width, height, 12) if house else textures.wood(self._noise),
                                             'skyline', 1.0)
            low = self._height(x, y) - 2
            self._batch.quad([(x - tx, y - ty, low), (x + tx, y + ty, low), (x + tx, y + ty, low + height + 2),
                              (x - tx, y - ty, low + height + 2)], material)

    def _light_windows(self) -> None:
        glows: Dict[int, 'bpy.types.Material'] = {}
        for corners in self._lit:
            kind = self._day.randrange(5)
            if kind not in glows:
                room = .3 + .7 * placard(np.random.default_rng([self._spec.seed, 3, kind]), (40, 40))
                glows[kind] = meshes.image_material(room * np.array([1, .72, .4]), 'lit_window')
                surface = glows[kind].node_tree.nodes['Principled BSDF']
                texture = glows[kind].node_tree.nodes['Image Texture']
                glows[kind].node_tree.links.new(texture.outputs['Color'], surface.inputs['Emission'])
                surface.inputs['Emission Strength'].default_value = .05 + .04 * kind
                glows[kind].cycles.sample_as_light = False
            self._batch.quad(corners, glows[kind])


def overlap(a: np.ndarray, b: np.ndarray, gap_m: float = .5) -> bool:
    """Do two convex quadrilaterals come closer than a gap? (separating axes)"""
    if np.linalg.norm(a.mean(0) - b.mean(0)) > 20:
        return False
    for corners in (a, b):
        for edge in (corners[1] - corners[0], corners[2] - corners[1]):
            axis = np.array([-edge[1], edge[0]]) / np.linalg.norm(edge)
            if (a @ axis).max() + gap_m < (b @ axis).min() or (b @ axis).max() + gap_m < (a @ axis).min():
                return False
    return True


def add_light(scene: 'bpy.types.Scene', spec: Spec) -> None:
    rng = random.Random(f'town sky {spec.seed} {spec.day} {spec.round}')
    if spec.day in ('sunny_high', 'sunny_low'):
        elevation = rng.uniform(44, 56) if spec.day == 'sunny_high' else rng.uniform(9, 14)
        lights.add_clear_sky(scene, elevation, rng.uniform(0, 360), .35 if spec.day == 'sunny_high' else .8, .12)
        lights.add_clouds(scene, .32, 9, rng.randrange(1000))
        return
    strength = {'overcast': .8, 'wet': .6, 'dusk': .012}[spec.day]
    lights.add_overcast_sky(scene, strength, rng.uniform(0, 6.28))
    lights.add_clouds(scene, .55, .45, rng.randrange(1000))
    if spec.day == 'dusk':
        bpy.data.lights['sun'].energy = 0


def build(scene: 'bpy.types.Scene', spec: Spec):
    plan = TownPlan(spec.seed)
    places = Town(scene, plan, spec).build()
    add_light(scene, spec)
    drive = town_drive(plan, spec)
    if spec.day == 'dusk':
        drive.on_move = lights.NearLamps(lights.add_lamps(scene, places, 130))
    return drive
