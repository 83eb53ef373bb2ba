"""East and north near a position of the WGS84 ellipsoid, and those of a map."""
import math
from pathlib import Path
from typing import Dict, Sequence, Tuple

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


def fixes_of(bag: Path, topic: str) -> np.ndarray:
    """Rows of stamp (s), latitude and longitude (degrees) of the NavSatFix on `topic`."""
    import rosbag  # pylint: disable=import-outside-toplevel
    with rosbag.Bag(str(bag)) as recording:
        fixes = np.array([(message.header.stamp.to_sec(), message.latitude, message.longitude)
                          for _, message, _ in recording.read_messages([topic])])
    if not len(fixes):
        raise ValueError(f'{bag}: there is nothing on {topic}')
    return fixes


class LocalFrame:
    """East and north of the map, tied to the ellipsoid by a row of a table that has both."""

    def __init__(self, row: Dict[str, str]):
        self.tie = [float(row[name]) for name in ('latitude_deg', 'longitude_deg', 'east_m', 'north_m')]
        self.east_m, self.north_m = metres_per_degree(self.tie[0])

    def position(self, latitude: np.ndarray, longitude: np.ndarray) -> np.ndarray:
        """Rows of east and north, metres."""
        return np.column_stack(((longitude - self.tie[1]) * self.east_m + self.tie[2],
                                (latitude - self.tie[0]) * self.north_m + self.tie[3]))


def geodetic(datum: Sequence[float], east: float, north: float, up: float) -> Tuple[float, float, float]:
    """Latitude and longitude in degrees and altitude of a position in metres from `datum`, which is given so too."""
    latitude, longitude = math.radians(datum[0]), math.radians(datum[1])
    sin_lat, cos_lat, sin_lon, cos_lon = math.sin(latitude), math.cos(latitude), math.sin(longitude), math.cos(longitude)
    radius = SEMI_MAJOR_M / math.sqrt(1 - ECCENTRICITY2 * sin_lat ** 2)
    outwards = (radius + datum[2] + up) * cos_lat - north * sin_lat  # from the Earth's axis, on the datum's meridian
    x, y = outwards * cos_lon - east * sin_lon, outwards * sin_lon + east * cos_lon
    z = (radius * (1 - ECCENTRICITY2) + datum[2] + up) * sin_lat + north * cos_lat
    distance = math.hypot(x, y)
    latitude = math.atan2(z, distance * (1 - ECCENTRICITY2))
    for _ in range(5):  # each step gains more than two digits
        radius = SEMI_MAJOR_M / math.sqrt(1 - ECCENTRICITY2 * math.sin(latitude) ** 2)
        latitude = math.atan2(z + ECCENTRICITY2 * radius * math.sin(latitude), distance)
    altitude = distance * math.cos(latitude) + z * math.sin(latitude) - SEMI_MAJOR_M ** 2 / radius
    return math.degrees(latitude), math.degrees(math.atan2(y, x)), altitude
