"""East and north of a map, in Python."""
import math
from typing import Dict

import numpy as np


class LocalFrame:
    """East and north of the map, tied to the ellipsoid by a row of a table that has both."""

    def __init__(self, row: Dict[str, str]):
        self.tie = [float(row[name]) for name in ('latitude_deg', 'longitude_deg', 'east_m', 'north_m')]
        sine = math.sin(math.radians(self.tie[0]))
        ratio = 1 - 0.00669437999014 * sine * sine  # WGS84
        self.east_m = math.radians(6378137.0 / math.sqrt(ratio) * math.cos(math.radians(self.tie[0])))
        self.north_m = math.radians(6378137.0 * (1 - 0.00669437999014) / ratio ** 1.5)

    def position(self, latitude: np.ndarray, longitude: np.ndarray) -> np.ndarray:
        """Rows of east and north, metres."""
        return np.column_stack(((longitude - self.tie[1]) * self.east_m + self.tie[2],
                                (latitude - self.tie[0]) * self.north_m + self.tie[3]))
