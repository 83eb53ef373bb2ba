"""A camera as a robot carries it: distortion, vignetting, slow automatic exposure, motion blur, noise."""
import csv
import math
import os
from pathlib import Path
from typing import List, Sequence

import bpy
import cv2
import mathutils
import numpy as np

from worlds.campus_course import CameraPose
from worlds.course import HillyDrive, rotation
from worlds.lens import Lens
from worlds.renderer import add_camera, configure_renderer
from worlds.spec import Light

MIDDLE_GREY = .17  # of the scene's mean after exposure, linear
METER_EVERY_M = 5.0
METER_TIME_S = 5.0  # the exposure follows so slowly
LUMINANCE = (.2126, .7152, .0722)


def tone_curve(linear: np.ndarray) -> np.ndarray:
    """Exposed light to grey levels 0 to 255: soft at the white end, then the curve of sRGB."""
    soft = 1 - np.exp(-1.4 * np.maximum(linear, 0))
    return 255 * np.where(soft < .0031308, 12.92 * soft, 1.055 * np.maximum(soft, 1e-9) ** (1 / 2.4) - .055)


def smoothed(gains: Sequence[float], spacing_s: float) -> np.ndarray:
    """The gains around a closed course as a slow controller follows them: of first order, in stops, after one lap."""
    follow = 1 - math.exp(-spacing_s / METER_TIME_S)
    stops = np.log2(gains)
    state, result = stops.mean(), np.empty(len(stops))
    for k in range(2 * len(stops)):
        state += follow * (stops[k % len(stops)] - state)
        result[k % len(stops)] = state
    return 2 ** result


class SensorCamera:
    """Renders a wider pinhole image in linear light and develops it."""

    def __init__(self, scene: 'bpy.types.Scene', lens: Lens, samples: int, light: Light, folder: Path):
        self._scene, self._lens, self._light, self._folder = scene, lens, light, folder
        self._samples = samples
        self._camera = add_camera(scene, 60)
        self._camera.data.sensor_fit = 'HORIZONTAL'
        self._camera.data.angle = lens.pinhole_angle_rad
        self._camera.data.clip_end = 2000
        self._camera.rotation_mode = 'QUATERNION'
        configure_renderer(scene, lens.pinhole_size, samples)
        scene.view_settings.view_transform = 'Raw'
        scene.render.image_settings.file_format = 'OPEN_EXR'
        scene.render.image_settings.color_mode = 'RGB'
        scene.render.image_settings.color_depth = '16'
        scene.render.use_motion_blur = False
        scene.render.motion_blur_shutter = 1.0
        self._gains: List[float] = []
        self._metered_m = METER_EVERY_M

    def meter(self, drive: HillyDrive, speed_m_s: float) -> None:
        """Looks at the brightness along the course, or reads what was seen. So any frame can be rendered alone."""
        path = self._folder / 'exposure.csv'
        count = max(1, round(drive.length_m / METER_EVERY_M))
        self._metered_m = drive.length_m / count
        if path.exists():
            with open(path, newline='', encoding='utf-8') as file:
                self._gains = [float(row['gain']) for row in csv.DictReader(file)]
            if len(self._gains) == count:
                return
        size, self._scene.cycles.samples = self._lens.pinhole_size, 4
        self._scene.render.resolution_x, self._scene.render.resolution_y = (side // 8 for side in size)
        seen = [self._shoot(drive.pose(k, k * self._metered_m)) for k in range(count)]
        self._scene.render.resolution_x, self._scene.render.resolution_y = size
        self._scene.cycles.samples = self._samples
        # A bright sky counts only so much.
        raw = [MIDDLE_GREY / max(1e-6, np.minimum(grey, 4 * np.median(grey) + 1e-6).mean()) for grey in seen]
        self._gains = list(smoothed(raw, self._metered_m / speed_m_s))
        temporary = path.with_suffix(f'.{os.getpid()}')
        with open(temporary, 'w', newline='', encoding='utf-8') as file:
            writer = csv.writer(file)
            writer.writerow(['distance_m', 'gain'])
            writer.writerows([f'{k * self._metered_m:.2f}', f'{gain:.6g}'] for k, gain in enumerate(self._gains))
        temporary.replace(path)

    def take(self, pose: CameraPose, distance_m: float, speed_m_s: float, path: Path) -> None:
        """Renders one frame unless it exists."""
        if path.exists():
            return
        self._scene.cycles.seed = pose.render_seed
        linear = self._lens.remap(self._shoot(pose, speed_m_s)) * self._lens.vignette * self._gain(distance_m)
        rng = np.random.default_rng(pose.render_seed)
        grey = tone_curve(linear) + rng.normal(0, self._light.noise, linear.shape)
        temporary = path.with_suffix('.part.png')
        cv2.imwrite(str(temporary), np.clip(np.rint(grey), 0, 255).astype(np.uint8))
        temporary.replace(path)

    def _gain(self, distance_m: float) -> float:
        position = distance_m / self._metered_m
        stops = np.log2(self._gains)
        return float(2 ** np.interp(position, np.arange(len(stops) + 1), np.append(stops, stops[0])))

    def _place(self, pose: CameraPose, late_s: float, speed_m_s: float) -> None:
        """The camera at so many seconds after the middle of the exposure."""
        body = rotation(pose.roll_rad, pose.pitch_rad, pose.yaw_rad)
        shake = [rate * late_s for rate in pose.rates]
        turned = body @ rotation(*shake)
        # Blender's camera looks along -z, with y upwards.
        axes = np.stack([-turned[:, 1], turned[:, 2], -turned[:, 0]], 1)
        self._camera.location = np.array([pose.x_m, pose.y_m, pose.z_m]) + body[:, 0] * speed_m_s * late_s
        self._camera.rotation_quaternion = mathutils.Matrix(axes.tolist()).to_quaternion()

    def _shoot(self, pose: CameraPose, speed_m_s: float = 0) -> np.ndarray:
        """The pinhole image as linear grey, rows from the top. With a speed it is blurred by the motion."""
        if speed_m_s > 0:
            self._animate(pose, speed_m_s)
        self._scene.render.use_motion_blur = speed_m_s > 0
        self._place(pose, 0, speed_m_s)
        raw = self._folder / f'.raw_{os.getpid()}.exr'
        self._scene.render.filepath = str(raw)
        bpy.ops.render.render(write_still=True)
        self._camera.animation_data_clear()
        image = bpy.data.images.load(str(raw))
        image.colorspace_settings.name = 'Non-Color'
        width, height = image.size
        pixels = np.empty(width * height * image.channels, np.float32)
        image.pixels.foreach_get(pixels)
        bpy.data.images.remove(image)
        raw.unlink()
        return pixels.reshape(height, width, -1)[::-1, :, :3] @ np.array(LUMINANCE)

    def _animate(self, pose: CameraPose, speed_m_s: float) -> None:
        """The shutter is open from half a frame before to half a frame after frame 1."""
        for frame, sign in ((0, -1), (2, 1)):
            self._place(pose, sign * self._light.shutter_s, speed_m_s)
            self._camera.keyframe_insert('location', frame=frame)
            self._camera.keyframe_insert('rotation_quaternion', frame=frame)
        for curve in self._camera.animation_data.action.fcurves:
            for key in curve.keyframe_points:
                key.interpolation = 'LINEAR'
        self._scene.frame_set(1)
