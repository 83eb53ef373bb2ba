"""Camera and renderer of every world."""
import math
from pathlib import Path

import bpy

from worlds.campus_course import CameraPose


def add_camera(scene: 'bpy.types.Scene', field_of_view_deg: float) -> 'bpy.types.Object':
    data = bpy.data.cameras.new('camera')
    data.lens_unit = 'FOV'
    data.angle = math.radians(field_of_view_deg)
    camera = bpy.data.objects.new('camera', data)
    scene.collection.objects.link(camera)
    scene.camera = camera
    return camera


def configure_renderer(scene: 'bpy.types.Scene', size: tuple, samples: int) -> None:
    """Path tracing on the CPU, few samples and no denoising: what is left is the sensor's noise."""
    cycles = scene.cycles
    scene.render.engine = 'CYCLES'
    cycles.device = 'CPU'
    cycles.samples = samples
    cycles.use_denoising = False
    cycles.max_bounces = 2
    cycles.diffuse_bounces = 1
    cycles.use_adaptive_sampling = True
    cycles.adaptive_threshold = .05
    scene.render.resolution_x, scene.render.resolution_y = size
    scene.render.image_settings.file_format = 'PNG'
    scene.render.image_settings.color_mode = 'BW'
    scene.render.use_persistent_data = True
    scene.view_settings.view_transform = 'Filmic'
    scene.view_settings.exposure = .4


class PlainCamera:
    """Blender's own pinhole camera and tone curve."""

    def __init__(self, scene: 'bpy.types.Scene', field_of_view_deg: float, size: tuple, samples: int):
        self._scene = scene
        self._camera = add_camera(scene, field_of_view_deg)
        configure_renderer(scene, size, samples)

    def take(self, pose: CameraPose, path: Path) -> None:
        """Renders one frame unless it exists."""
        self._scene.cycles.seed = pose.render_seed
        self._camera.location = (pose.x_m, pose.y_m, pose.z_m)
        self._camera.rotation_euler = (math.pi / 2 + pose.pitch_rad, 0, pose.yaw_rad - math.pi / 2)
        self._scene.render.filepath = str(path)
        if not path.exists():
            bpy.ops.render.render(write_still=True)
