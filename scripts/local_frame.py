"""East and north near a position of the WGS84 ellipsoid, and those of a map."""
import math
from typing import Dict, Tuple

import numpy as np


SEMI_MAJOR_M = 6378137.0
FLATTENING = 1 / 298.257223563
ECCENTRICITY2 = FLATTENING * (2 - FLATTENING)


def metres_per_degree(latitude: float, altitude: float = 0.0) -> Tuple[float, float]:
    """How long a degree of longitude is, and one of latitude; `latitude` in degrees, `altitude` in metres."""
    ratio = 1 - ECCENTRICITY2 * math.sin(math.radians(latitude)) ** 2
    prime_vertical = SEMI_MAJOR_M / math.sqrt(ratio)
    meridian = SEMI_MAJOR_M * (1 - ECCENTRICITY2) / ratio ** 1.5
    return (math.radians((prime_vertical + altitude) * math.cos(math.radians(latitude))),
            math.radians(meridian + altitude))


class LocalFrame:
    """East and north of the map, tied to the ellipsoid by a row of a table that has both."""

    def __init__(self, row: Dict[str, str]):
        self.tie = [float(row[name]) for name in ('latitude_deg', 'longitude_deg', 'east_m', 'north_m')]
        self.east_m, self.north_m = metres_per_degree(self.tie[0])

    def position(self, latitude: np.ndarray, longitude: np.ndarray) -> np.ndarray:
        """Rows of east and north, metres."""
        return np.column_stack(((longitude - self.tie[1]) * self.east_m + self.tie[2],
                                (latitude - self.tie[0]) * self.north_m + self.tie[3]))
