"""What cameras do to images: darkness, glare, dirt, blur, noise, other sizes, standing still. For measurements and tests.

Each fault takes a grey image (numpy, uint8), its number and a numpy Generator and returns an image of the same kind.
"""
from typing import Callable, Dict

import cv2
import numpy as np

Fault = Callable[[np.ndarray, int, np.random.Generator], np.ndarray]


def to_bytes(grey: np.ndarray) -> np.ndarray:
    """Values beyond the sensor's range are clipped, as by a sensor."""
    return np.clip(np.rint(grey), 0, 255).astype(np.uint8)


def exposed(grey: np.ndarray, gain: float, generator: np.random.Generator, noise: float = 1.0) -> np.ndarray:
    """Another exposure of the same scene: what is lost to darkness or glare stays lost. `noise`: grey levels."""
    return to_bytes(grey * gain + generator.normal(0.0, noise, grey.shape))


def blurred(grey: np.ndarray, length_px: int) -> np.ndarray:
    """The camera turned by so many pixels during the exposure."""
    return cv2.blur(grey, (length_px, 1), borderType=cv2.BORDER_REPLICATE)


def soiled(grey: np.ndarray, radius: float) -> np.ndarray:
    """A dark spot of dirt with a soft rim; `radius` is a share of the image's height."""
    height, width = grey.shape
    rows, columns = np.mgrid[0:height, 0:width]
    distance = np.hypot(rows - 0.45 * height, columns - 0.6 * width) / height
    cover = np.clip((radius - distance) / 0.04 + 0.5, 0.0, 1.0)
    return to_bytes(grey * (1.0 - cover) + (25.0 + 10.0 * np.sin(0.2 * columns) * np.cos(0.15 * rows)) * cover)


def scaled(grey: np.ndarray, factor: float) -> np.ndarray:
    method = cv2.INTER_AREA if factor < 1.0 else cv2.INTER_LINEAR
    return cv2.resize(grey, None, fx=factor, fy=factor, interpolation=method)


def cropped(grey: np.ndarray, share: float) -> np.ndarray:
    """Only the middle `share` of the rows: a wider picture, as 16:9 beside 4:3."""
    margin = round(grey.shape[0] * (1.0 - share) / 2.0)
    return grey[margin:grey.shape[0] - margin]


def flat(grey: np.ndarray, level: int) -> np.ndarray:
    """Nothing at all, not even noise."""
    return np.full_like(grey, level)


FAULTS: Dict[str, Fault] = {
    'none': lambda grey, number, generator: grey,
    'half resolution': lambda grey, number, generator: scaled(grey, 0.5),
    'double resolution': lambda grey, number, generator: scaled(grey, 2.0),
    'stretched to 16:9': lambda grey, number, generator: cv2.resize(grey, (grey.shape[0] * 16 // 9, grey.shape[0])),
    'cropped to 16:9': lambda grey, number, generator: cropped(grey, 0.75),
    'dark, a fifth of the light': lambda grey, number, generator: exposed(grey, 0.2, generator),
    'dark, a twentieth of the light': lambda grey, number, generator: exposed(grey, 0.05, generator),
    'bright, twice the light': lambda grey, number, generator: exposed(grey, 2.0, generator),
    'bright, five times the light': lambda grey, number, generator: exposed(grey, 5.0, generator),
    'noise of 10 grey levels': lambda grey, number, generator: exposed(grey, 1.0, generator, 10.0),
    'noise of 30 grey levels': lambda grey, number, generator: exposed(grey, 1.0, generator, 30.0),
    'motion blur of 7 pixels': lambda grey, number, generator: blurred(grey, 7),
    'motion blur of 21 pixels': lambda grey, number, generator: blurred(grey, 21),
    'dirt on 10 % of the image': lambda grey, number, generator: soiled(grey, 0.2),
    'dirt on 38 % of the image': lambda grey, number, generator: soiled(grey, 0.4),
    'noise alone': lambda grey, number, generator: exposed(flat(grey, 128), 1.0, generator, 30.0),
    'black': lambda grey, number, generator: flat(grey, 0),
    'white': lambda grey, number, generator: flat(grey, 255),
}
