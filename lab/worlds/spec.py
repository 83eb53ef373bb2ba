"""What distinguishes one round from another, and what a world prefers. Needs no Blender."""
from dataclasses import dataclass
from typing import Dict, Optional, Tuple

Distortion = Tuple[float, float, float, float, float]  # plumb_bob: k1, k2, p1, p2, k3


@dataclass(frozen=True)
class Spec:
    """Which world is rendered, in which light, and in which round."""

    seed: int
    day: str
    round: int
    spacing_m: float
    raise_m: float = 0  # the camera
    pitch_rad: float = 0  # the camera upwards


@dataclass(frozen=True)
class Light:
    """What the light of a day means to the camera."""

    shutter_s: float
    noise: float  # grey levels of the read-out
    grey: float = .17  # of the mean of the lower two thirds after exposure, linear


@dataclass(frozen=True)
class Defaults:
    """What a world has unless it is asked for something else."""

    days: Dict[str, Light]
    spacing_m: float
    pitch_deg: float
    distortion: Optional[Distortion]  # None: Blender's own camera and tone curve


_BARREL = (-.28, .09, 0, 0, 0)
_SUN, _CLOUDS = Light(.002, .8), Light(.008, 1.2)
DEFAULTS = {
    'campus': Defaults({'sunny': _SUN, 'cloudy': _CLOUDS}, .65, 0, None),
    'town': Defaults({'sunny_high': _SUN, 'sunny_low': Light(.004, 1), 'overcast': _CLOUDS,
                      'dusk': Light(.03, 2.5, .08), 'wet': Light(.012, 1.5)}, 1.0, 4, _BARREL),
    'meadow': Defaults({'sunny': _SUN, 'overcast': _CLOUDS}, .65, 0, _BARREL),
}
