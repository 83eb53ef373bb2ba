"""A camera as a robot carries it: distortion, vignetting, slow automatic exposure, motion blur, noise."""
import csv
import math
import os
from pathlib import Path
from typing import List, Sequence

import bpy
import mathutils
import numpy as np

from worlds.campus_course import CameraPose
from worlds.course import HillyDrive, rotation
from worlds.lens import Lens
from worlds.renderer import add_camera, configure_renderer
from worlds.spec import Light

os.environ['OPENCV_IO_ENABLE_OPENEXR'] = '1'  # OpenCV asks for it when it is loaded
import cv2  # noqa: E402

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

    def __init__(self, scene: 'bpy.types.Scene', lens: Lens, samples: int, light: Light, drive: HillyDrive,
                 folder: Path):
        self._scene, self._lens, self._light, self._folder = scene, lens, light, folder
        self._drive = drive
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
        # Never off: when it is switched, the renderer loses texture coordinates of meshes that persist.
        scene.render.use_motion_blur = True
        scene.render.motion_blur_shutter = 1.0
        self._add_motion()
        self._gains: List[float] = []
        self._metered_m = METER_EVERY_M

    def meter(self, speed_m_s: float) -> None:
        """Looks at the brightness along the course, or reads what was seen. So any frame can be rendered alone."""
        path, drive = self._folder / 'exposure.csv', self._drive
        count = max(1, round(drive.length_m / METER_EVERY_M))
        self._metered_m = drive.length_m / count
        if path.exists():
            with open(path, newline='', encoding='utf-8') as file:
                self._gains = [float(row['gain']) for row in csv.DictReader(file)]
            if len(self._gains) == count:
                return
        size, self._scene.cycles.samples = self._lens.pinhole_size, 4
        self._scene.render.resolution_x, self._scene.render.resolution_y = (side // 8 for side in size)
        seen = [self._shoot(drive.pose(k, k * self._metered_m))[size[1] // 24:] for k in range(count)]
        self._scene.render.resolution_x, self._scene.render.resolution_y = size
        self._scene.cycles.samples = self._samples
        # A bright sky counts only so much.
        raw = [self._light.grey / max(1e-6, np.minimum(grey, 4 * np.median(grey) + 1e-6).mean()) for grey in seen]
        # As the file has them, so that a frame does not depend on who measured.
        self._gains = [float(f'{gain:.6g}') for gain in smoothed(raw, self._metered_m / speed_m_s)]
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
        gain = self._gain(distance_m)
        # What a pixel's few samples see by chance of a lamp must not outshine it.
        self._scene.cycles.sample_clamp_direct, self._scene.cycles.sample_clamp_indirect = 6 / gain, .5 / gain
        linear = self._lens.remap(self._shoot(pose, speed_m_s)) * self._lens.vignette * gain
        rng = np.random.default_rng(pose.render_seed)
        grey = tone_curve(linear) + rng.normal(0, self._light.noise, linear.shape)
        temporary = path.with_suffix('.part.png')
        cv2.imwrite(str(temporary), np.clip(np.rint(grey), 0, 255).astype(np.uint8))
        temporary.replace(path)

    def _gain(self, distance_m: float) -> float:
        position = distance_m / self._metered_m
        stops = np.log2(self._gains)
        return float(2 ** np.interp(position, np.arange(len(stops) + 1), np.append(stops, stops[0])))

    def _placed(self, pose: CameraPose, late_s: float, speed_m_s: float) -> Sequence[float]:
        """Location and rotation of the camera so many seconds after the middle of the exposure."""
        body = rotation(pose.roll_rad, pose.pitch_rad, pose.yaw_rad)
        turned = body @ rotation(*(rate * late_s for rate in pose.rates))
        # Blender's camera looks along -z, with y upwards.
        axes = np.stack([-turned[:, 1], turned[:, 2], -turned[:, 0]], 1)
        place = np.array([pose.x_m, pose.y_m, pose.z_m]) + body[:, 0] * speed_m_s * late_s
        return [*place, *mathutils.Matrix(axes.tolist()).to_quaternion()]

    def _add_motion(self) -> None:
        """Curves of the camera's location and rotation. The shutter is open from frame 0.5 to frame 1.5."""
        for frame in (0, 2):
            self._camera.keyframe_insert('location', frame=frame)
            self._camera.keyframe_insert('rotation_quaternion', frame=frame)
        self._curves = list(self._camera.animation_data.action.fcurves)
        for curve in self._curves:
            for key in curve.keyframe_points:
                key.interpolation = 'LINEAR'

    def _move(self, pose: CameraPose, speed_m_s: float) -> None:
        """Through the pose in the middle of the exposure."""
        start, end = (self._placed(pose, sign * self._light.shutter_s, speed_m_s) for sign in (-1, 1))
        if np.dot(start[3:], end[3:]) < 0:
            end = [*end[:3], *(-value for value in end[3:])]  # the same rotation, not the long way round
        for curve, first, last in zip(self._curves, start, end):
            for key, value in zip(curve.keyframe_points, (first, last)):
                key.co[1] = key.handle_left[1] = key.handle_right[1] = value
            curve.update()
        self._scene.frame_set(1)

    def _shoot(self, pose: CameraPose, speed_m_s: float = 0) -> np.ndarray:
        """The pinhole image as linear grey, rows from the top. With a speed it is blurred by the motion."""
        self._drive.on_move(pose.x_m, pose.y_m)
        self._move(pose, speed_m_s)
        raw = self._folder / f'.raw_{os.getpid()}.exr'
        self._scene.render.filepath = str(raw)
        bpy.ops.render.render(write_still=True)
        pixels = cv2.imread(str(raw), cv2.IMREAD_UNCHANGED)
        if pixels is None:
            raise SystemExit(f'render_world: {raw}: OpenCV of Blender\'s Python cannot read OpenEXR')
        raw.unlink()
        return pixels[..., ::-1] @ np.array(LUMINANCE)
