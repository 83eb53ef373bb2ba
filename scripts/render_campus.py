"""Renders one round around the main building of a procedural campus, as a robot with a camera drives it.

blender -b -P scripts/render_campus.py -- --seed 1 --day sunny --round 0 --out DIR

Writes DIR/frame_%04d.png (grey) and DIR/pose.csv (index,t,x,y,z,yaw: seconds, metres and radians of
the camera in a local east-north-up frame). Needs Blender 3.4. Frames that exist already are not rendered
again, so an interrupted round can be continued.
"""
import argparse
import csv
import math
import random
import re
import sys
from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))
from campus.drive import CameraPose, Drive  # noqa: E402
from campus.world import BUILDING, World  # noqa: E402


def image_size(text: str) -> tuple:
    """Pixels from WIDTHxHEIGHT."""
    match = re.fullmatch(r'([1-9][0-9]{1,3})x([1-9][0-9]{1,3})', text)
    if match is None:
        raise argparse.ArgumentTypeError(f"'{text}' is not WIDTHxHEIGHT, each 10 to 9999")
    return int(match[1]), int(match[2])


def parse_arguments() -> argparse.Namespace:
    """The arguments behind Blender's own `--`."""
    arguments = sys.argv[sys.argv.index('--') + 1:] if '--' in sys.argv else []
    parser = argparse.ArgumentParser(prog='render_campus.py', description=__doc__.splitlines()[0])
    parser.add_argument('--seed', type=int, default=1, help='the campus (default: %(default)s)')
    parser.add_argument('--day', choices=['sunny', 'cloudy'], default='sunny', help='light and parked cars')
    parser.add_argument('--round', type=int, default=0, help='people, path offsets, height of the sun')
    parser.add_argument('--out', type=Path, required=True, help='folder to write to')
    parser.add_argument('--spacing', type=float, default=0.65, help='metres between images (default: %(default)s)')
    parser.add_argument('--size', type=image_size, default=(320, 240), help='of the image, pixels (default: 320x240)')
    parser.add_argument('--field-of-view', type=float, default=62, help='horizontal, degrees (default: %(default)s)')
    parser.add_argument('--raise', dest='raise_m', type=float, default=0,
                        help='the camera by so many metres (default: %(default)s)')
    parser.add_argument('--pitch', type=float, default=0, help='the camera upwards, degrees (default: %(default)s)')
    parser.add_argument('--samples', type=int, default=12, help='light samples a pixel (default: %(default)s)')
    parser.add_argument('--first', type=int, default=0, help='first frame to render')
    parser.add_argument('--last', type=int, default=10**9, help='last frame to render')
    parser.add_argument('--every', type=int, default=1, help='render only every so many frames')
    return parser.parse_args(arguments)


def add_light(scene: 'bpy.types.Scene', day: str, round_: int) -> None:
    """A sun in a clear sky that moves on from round to round, or an overcast sky that brightens."""
    world = bpy.data.worlds.new('world')
    scene.world = world
    world.use_nodes = True
    background = world.node_tree.nodes['Background']
    if day == 'sunny':
        sky = world.node_tree.nodes.new('ShaderNodeTexSky')
        sky.sky_type = 'NISHITA'
        sky.sun_elevation = math.radians(38 + 2.5 * round_)
        sky.sun_rotation = math.radians(140 + 7 * round_)
        sky.sun_intensity = .35
        world.node_tree.links.new(sky.outputs['Color'], background.inputs['Color'])
        background.inputs['Strength'].default_value = .12
        return
    background.inputs['Color'].default_value = (.75, .8, .88, 1)
    background.inputs['Strength'].default_value = .55 + .12 * round_
    sun = bpy.data.lights.new('sun', 'SUN')
    sun.energy = .25
    sun.angle = .9
    lamp = bpy.data.objects.new('sun', sun)
    lamp.rotation_euler = (.7, .3, 1.2 + .1 * round_)
    scene.collection.objects.link(lamp)


def add_camera(scene: 'bpy.types.Scene', field_of_view_deg: float) -> 'bpy.types.Object':
    """A pinhole camera."""
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


def render(scene: 'bpy.types.Scene', camera: 'bpy.types.Object', pose: CameraPose, path: Path) -> None:
    """Renders one frame unless it exists."""
    scene.cycles.seed = pose.render_seed
    camera.location = (pose.x_m, pose.y_m, pose.z_m)
    camera.rotation_euler = (math.pi / 2 + pose.pitch_rad, 0, pose.yaw_rad - math.pi / 2)
    scene.render.filepath = str(path)
    if not path.exists():
        bpy.ops.render.render(write_still=True)


def main() -> None:
    """Builds the campus and drives one round."""
    args = parse_arguments()
    plan = random.Random(args.seed)
    noise = np.random.default_rng(args.seed)
    day = random.Random(args.seed * 100 + (7 if args.day == 'sunny' else 8))
    round_ = random.Random(args.seed * 1000 + (10 if args.day == 'sunny' else 20) + args.round)

    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    World(plan, noise, day, round_).build()
    add_light(scene, args.day, args.round)
    camera = add_camera(scene, args.field_of_view)
    configure_renderer(scene, args.size, args.samples)

    drive = Drive(BUILDING, args.spacing, round_)
    args.out.mkdir(parents=True, exist_ok=True)
    with open(args.out / 'pose.csv', 'w', newline='', encoding='utf-8') as file:
        writer = csv.writer(file)
        writer.writerow(['index', 't', 'x', 'y', 'z', 'yaw'])
        for pose in drive.poses():
            pose = replace(pose, z_m=round(pose.z_m + args.raise_m, 4),
                           pitch_rad=pose.pitch_rad + math.radians(args.pitch))
            writer.writerow([pose.index, f'{pose.time_s:.3f}', f'{pose.x_m:.4f}', f'{pose.y_m:.4f}', pose.z_m,
                             f'{pose.yaw_rad:.5f}'])
            if args.first <= pose.index <= args.last and pose.index % args.every == 0:
                render(scene, camera, pose, args.out / f'frame_{pose.index:04d}.png')
    print(f'{drive.count} frames, {drive.loop.length_m:.1f} m')


if __name__ == '__main__':
    main()
