"""Builds the campus in Blender: the main building, what surrounds it, its light, and what changes by day and round."""
import math
import random
from typing import List, Tuple

import bpy
import numpy as np

from worlds import lights, meshes, textures
from worlds.campus_course import Drive
from worlds.spec import Spec

BUILDING = (66.0, 33.0)  # length along east and width along north, metres; its corner is the origin

Point = Tuple[float, float]


def _beside_building(s: float, distance: float) -> Point:
    """The point `s` metres along the walls of the main building, `distance` in front of them."""
    length, width = BUILDING
    if s < length:
        return s, -distance
    if s < length + width:
        return length + distance, s - length
    if s < 2 * length + width:
        return 2 * length + width - s, width + distance
    return -distance, 2 * (length + width) - s


class Campus:
    """The campus. `plan` and `noise` decide what never changes, `day` the parked cars, `round` the people.

    Call the methods in the order of `build`: they draw from the same generators.
    """

    def __init__(self, plan: random.Random, noise: np.random.Generator, day: random.Random, round_: random.Random):
        self._plan = plan
        self._noise = noise
        self._day = day
        self._round = round_
        self._facades = textures.FacadePainter(plan, noise)
        self._roof = meshes.flat_material((.25, .22, .2), 'roof')

    def build(self) -> None:
        """Builds everything but light and camera."""
        self._add_building(0, 0, *BUILDING, 12.5)
        self._add_neighbours()
        self._add_ground()
        self._add_trees()
        self._add_lamp_posts()
        self._add_cars()
        self._add_people()
        self._add_skyline()

    def _facade(self, width_m: float, height_m: float, pixels_per_metre: int, name: str) -> 'bpy.types.Material':
        return meshes.image_material(self._facades.paint(width_m, height_m, pixels_per_metre), name)

    def _add_building(self, x0: float, y0: float, x1: float, y1: float, height: float) -> None:
        corners = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
        for k in range(4):
            (ax, ay), (bx, by) = corners[k], corners[(k + 1) % 4]
            length = math.hypot(bx - ax, by - ay)
            parts = max(1, round(length / 22))  # several textures along a long wall
            for part in range(parts):
                start = (ax + (bx - ax) * part / parts, ay + (by - ay) * part / parts)
                end = (ax + (bx - ax) * (part + 1) / parts, ay + (by - ay) * (part + 1) / parts)
                outward = (by - ay) / length, -(bx - ax) / length
                self._add_wall(start, end, outward, length / parts, height)
        meshes.quad([(*corner, height) for corner in corners], self._roof)

    def _add_wall(self, start: Point, end: Point, outward: Point, length: float, height: float) -> None:
        wall = self._facade(length, height, 30, 'facade')
        meshes.quad([(*start, 0), (*end, 0), (*end, height), (*start, height)], wall)
        if self._plan.random() < .5:
            self._add_bay(start, end, outward, length, height)

    def _add_bay(self, start: Point, end: Point, outward: Point, length: float, height: float) -> None:
        """A bay breaks the flat wall: parallax and shadows."""
        plan = self._plan
        t0, t1 = sorted(plan.uniform(.1, .9) for _ in range(2))
        depth = plan.uniform(.4, 1.2)
        b0 = (start[0] + (end[0] - start[0]) * t0, start[1] + (end[1] - start[1]) * t0)
        b1 = (start[0] + (end[0] - start[0]) * t1, start[1] + (end[1] - start[1]) * t1)
        o0 = (b0[0] + outward[0] * depth, b0[1] + outward[1] * depth)
        o1 = (b1[0] + outward[0] * depth, b1[1] + outward[1] * depth)
        top = plan.uniform(2.5, height)
        wall = self._facade(max(1.5, length * (t1 - t0)), top, 30, 'bay')
        for left, right in ((o0, o1), (b0, o0), (o1, b1)):
            meshes.quad([(*left, 0), (*right, 0), (*right, top), (*left, top)], wall)
        meshes.quad([(*b0, top), (*o0, top), (*o1, top), (*b1, top)], self._roof)

    def _add_neighbours(self) -> None:
        plan = self._plan
        length, width = BUILDING
        for k in range(plan.randint(11, 14)):
            height, front, depth = plan.uniform(5, 16), plan.uniform(10, 26), plan.uniform(8, 15)
            gap = plan.uniform(20, 34)
            side = k % 4
            along = plan.uniform(-25, (length if side in (0, 2) else width) + 5)
            if side == 0:
                self._add_building(along, -gap - depth, along + front, -gap, height)
            elif side == 1:
                self._add_building(length + gap, along, length + gap + depth, along + front, height)
            elif side == 2:
                self._add_building(along, width + gap, along + front, width + gap + depth, height)
            else:
                self._add_building(-gap - depth, along, -gap, along + front, height)

    def _add_ground(self) -> None:
        low, high = -70.0, 150.0
        near = meshes.image_material(textures.ground(low, high, BUILDING, self._noise), 'ground', 1.0)
        meshes.quad([(low, low, 0), (high, low, 0), (high, high, 0), (low, high, 0)], near)
        far = meshes.flat_material((.12, .2, .08), 'far', 1.0)
        meshes.quad([(-500, -500, -.05), (600, -500, -.05), (600, 600, -.05), (-500, 600, -.05)], far)

    def _add_trees(self) -> None:
        plan = self._plan
        trunk = meshes.flat_material((.15, .1, .07), 'trunk', 1.0)
        for _ in range(34):
            along = plan.random()
            distance = plan.uniform(15, 24) if plan.random() < .75 else plan.uniform(2, 4)
            x, y = _beside_building(along * 2 * sum(BUILDING), distance)
            self._add_tree(x, y, plan.uniform(.8, 1.6), trunk)

    def _add_tree(self, x: float, y: float, scale: float, trunk: 'bpy.types.Material') -> None:
        plan = self._plan
        meshes.cylinder((x, y, 1.3 * scale), .14 * scale, 2.6 * scale, trunk)
        leaf = meshes.image_material(textures.leaves(self._noise), 'leaf', 1.0)
        for _ in range(7):
            radius = plan.uniform(.7, 1.3) * scale
            centre = (x + plan.uniform(-1, 1) * scale, y + plan.uniform(-1, 1) * scale,
                      (2.6 + plan.uniform(0, 2)) * scale)
            bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=3, radius=radius, location=centre)
            crown = bpy.context.object
            crown.data.materials.append(leaf)
            for vertex in crown.data.vertices:
                vertex.co *= plan.uniform(.75, 1.2)

    def _add_lamp_posts(self) -> None:
        pole = meshes.flat_material((.3, .3, .32), 'pole', .5)
        for k in range(18):
            x, y = _beside_building(k / 18 * 2 * sum(BUILDING), 14.5)
            meshes.cylinder((x, y, 2.5), .07, 5, pole)
            if self._plan.random() < .5:
                sign = meshes.image_material(textures.street_sign(self._noise), 'sign')
                meshes.quad([(x - .4, y - .1, 2.0), (x + .4, y + .1, 2.0), (x + .4, y + .1, 2.6),
                             (x - .4, y - .1, 2.6)], sign)

    def _add_cars(self) -> None:
        """A parking lot on the south side and a few along the streets: other cars on another day."""
        day = self._day
        glass = meshes.flat_material((.02, .02, .03), 'glass', .15, .6)
        tyre = meshes.flat_material((.02, .02, .02), 'tyre')
        for k in range(26):
            if day.random() >= .72:
                continue
            if k < 14:
                self._add_car(8 + k * 2.9, -15.2, math.pi / 2 + day.uniform(-.05, .05), glass, tyre)
            else:
                along = day.uniform(0, BUILDING[1] + 10)
                self._add_car(BUILDING[0] + 15.0 if k % 2 else -15.0, along - 5, math.pi / 2, glass, tyre)

    def _car_colour(self) -> List[float]:
        day = self._day
        if day.random() < .4:
            return [day.uniform(.02, .8) ** 1.3 for _ in range(3)]
        return [day.uniform(.03, .8)] * 3

    def _add_car(self, x: float, y: float, yaw: float, glass: 'bpy.types.Material',
                 tyre: 'bpy.types.Material') -> None:
        paint = meshes.flat_material(self._car_colour(), 'car', .35, .5)
        c, s = math.cos(yaw), math.sin(yaw)
        length, width = self._day.uniform(3.8, 4.8), 1.75
        meshes.box(x, y, .3, (length, width, .6), yaw, paint)
        meshes.box(x - .2 * c, y - .2 * s, .9, (length * .52, width * .9, .55), yaw, glass)
        meshes.box(x - .2 * c, y - .2 * s, 1.45, (length * .45, width * .88, .06), yaw, paint)
        for u, v in ((1.3, .8), (1.3, -.8), (-1.3, .8), (-1.3, -.8)):
            meshes.wheel((x + u * c - v * s, y + u * s + v * c, .32), yaw, tyre)

    def _add_people(self) -> None:
        rng = self._round
        for _ in range(10):
            x, distance = rng.uniform(0, BUILDING[0]), rng.choice([5.0, 13.5])
            y = -distance if rng.random() < .5 else BUILDING[1] + distance
            clothes = meshes.flat_material([rng.uniform(.02, .6) for _ in range(3)], 'person')
            meshes.cylinder((x, y, .85), .22, 1.7, clothes, 10)

    def _add_skyline(self) -> None:
        """Houses and woods all around, so that open views still hold something to recognise."""
        plan = self._plan
        for k in range(40):
            angle = 2 * math.pi * k / 40 + plan.uniform(-.05, .05)
            distance = plan.uniform(95, 160)
            cx, cy = BUILDING[0] / 2 + distance * math.cos(angle), BUILDING[1] / 2 + distance * math.sin(angle)
            width = plan.uniform(14, 34)
            tx, ty = -math.sin(angle) * width / 2, math.cos(angle) * width / 2
            height = plan.uniform(6, 22)
            if plan.random() < .55:
                material = self._facade(width, height, 12, 'house')
            else:
                material = meshes.image_material(textures.wood(self._noise), 'wood', 1.0)
                height *= .6
            meshes.quad([(cx - tx, cy - ty, 0), (cx + tx, cy + ty, 0), (cx + tx, cy + ty, height),
                         (cx - tx, cy - ty, height)], material)


def build(scene: 'bpy.types.Scene', spec: Spec) -> Drive:
    """The campus of a seed in the light of its day, and the drive around its main building."""
    sunny = spec.day == 'sunny'
    plan = random.Random(spec.seed)
    noise = np.random.default_rng(spec.seed)
    day = random.Random(spec.seed * 100 + (7 if sunny else 8))
    round_ = random.Random(spec.seed * 1000 + (10 if sunny else 20) + spec.round)
    Campus(plan, noise, day, round_).build()
    if sunny:
        lights.add_clear_sky(scene, 38 + 2.5 * spec.round, 140 + 7 * spec.round, .35, .12)
    else:
        lights.add_overcast_sky(scene, .55 + .12 * spec.round, 1.2 + .1 * spec.round)
    return Drive(BUILDING, spec.spacing_m, round_)
