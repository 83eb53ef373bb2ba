"""The drive around the main building: a rounded rectangle with wobble. Needs no Blender."""
import math
import random
from dataclasses import dataclass
from typing import Callable, Iterator, Tuple

CAMERA_HEIGHT_M = .95


@dataclass
class CameraPose:
    """Where the camera is in the local east-north frame; yaw 0 looks east, counter-clockwise."""

    index: int
    time_s: float
    x_m: float
    y_m: float
    z_m: float
    yaw_rad: float
    pitch_rad: float  # upwards
    render_seed: int  # other sensor noise in every frame
    roll_rad: float = 0  # to the right
    rates: Tuple[float, float, float] = (0, 0, 0)  # of roll, pitch and yaw while the shutter is open, rad/s


class Loop:
    """A closed rounded rectangle, `offset_m` outside a building whose corner is the origin."""

    CORNER_RADIUS_M = 5.0

    def __init__(self, building: Tuple[float, float], offset_m: float):
        radius = self.CORNER_RADIUS_M
        west, south = -offset_m, -offset_m
        east, north = building[0] + offset_m, building[1] + offset_m
        length, width = east - west - 2 * radius, north - south - 2 * radius
        quarter = math.pi * radius / 2
        # (length, is it straight, start or centre of the arc, first heading or angle in degrees)
        self._segments = (
            (length, True, (west + radius, south), 0), (quarter, False, (east - radius, south + radius), -90),
            (width, True, (east, south + radius), 90), (quarter, False, (east - radius, north - radius), 0),
            (length, True, (east - radius, north), 180), (quarter, False, (west + radius, north - radius), 90),
            (width, True, (west, north - radius), 270), (quarter, False, (west + radius, south + radius), 180))
        self.length_m = 2 * (length + width) + 2 * math.pi * radius

    def at(self, distance_m: float) -> Tuple[float, float, float]:
        """x, y and heading after `distance_m` along the loop."""
        for length, straight, (x, y), degrees in self._segments:
            if distance_m < length:
                if straight:
                    heading = math.radians(degrees)
                    return x + distance_m * math.cos(heading), y + distance_m * math.sin(heading), heading
                angle = math.radians(degrees) + distance_m / self.CORNER_RADIUS_M
                return (x + self.CORNER_RADIUS_M * math.cos(angle), y + self.CORNER_RADIUS_M * math.sin(angle),
                        angle + math.pi / 2)
            distance_m -= length
        return self.at(0)


class Drive:
    """One round: one image a second, every `spacing_m`, with other lateral offsets in every round."""

    def __init__(self, building: Tuple[float, float], spacing_m: float, rng: random.Random):
        self._rng = rng
        self._spacing_m = spacing_m
        self.on_move: Callable[[float, float], None] = lambda x, y: None
        self.loop = Loop(building, 9.0 + rng.uniform(-.45, .45))
        self.length_m = self.loop.length_m
        self.count = int(self.length_m / spacing_m)
        self._phases = [rng.uniform(0, 6.28) for _ in range(4)]

    def poses(self) -> Iterator[CameraPose]:
        """The camera poses in order. They draw from the round's generator, so consume them once and all."""
        rng, phases = self._rng, self._phases
        for index in range(self.count):
            s = index * self._spacing_m + rng.uniform(-.05, .05)
            x, y, heading = self.loop.at(max(0, s) % self.loop.length_m)
            lateral = .35 * math.sin(s / 17 + phases[0]) + .2 * math.sin(s / 5 + phases[1])
            yaw = heading + .05 * math.sin(s / 11 + phases[2]) + rng.gauss(0, .012)
            pitch = rng.gauss(0, .008)
            x -= lateral * math.sin(heading)
            y += lateral * math.cos(heading)
            yield CameraPose(index, index * 1.0, x, y, CAMERA_HEIGHT_M, yaw, pitch, rng.randrange(1 << 30))

    def pose(self, index: int, s: float) -> CameraPose:
        """The pose after `s` metres without wobble, to look around."""
        x, y, heading = self.loop.at(s % self.length_m)
        return CameraPose(index, index * 1.0, x, y, CAMERA_HEIGHT_M, heading, 0, 0)
