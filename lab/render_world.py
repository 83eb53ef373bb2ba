"""Renders one round through a procedural world, as a robot with a camera drives it.

blender -b -P lab/render_world.py -- --world town --seed 1 --day overcast --round 0 --out DIR

Worlds: campus (around the main building), town (700 m of streets on a hillside), meadow (195 m between hedges).
Writes DIR/frame_%04d.png (grey), DIR/camera.yaml (calibration) and DIR/pose.csv (index,t,x,y,z,yaw: seconds, metres
and radians of the camera in a local east-north-up frame; of town and meadow also roll,pitch by REP 103: x ahead, y
left, so a positive pitch looks down). Needs Blender 3.4, whose Python has OpenCV. Frames that exist already are not
rendered again, so an interrupted round can be continued.
"""
import argparse
import csv
import importlib
import math
import re
import sys
from dataclasses import replace
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).resolve().parent))
from worlds.campus_course import CameraPose  # noqa: E402
from worlds.lens import FILE_NAME, PINHOLE, Lens, write_calibration  # noqa: E402
from worlds.renderer import PlainCamera  # noqa: E402
from worlds.spec import DEFAULTS, Spec  # noqa: E402

IMAGE_PERIOD_S = 1.0


def image_size(text: str) -> tuple:
    """Pixels from WIDTHxHEIGHT."""
    match = re.fullmatch(r'([1-9][0-9]{1,3})x([1-9][0-9]{1,3})', text)
    if match is None:
        raise argparse.ArgumentTypeError(f"'{text}' is not WIDTHxHEIGHT, each 10 to 9999")
    return int(match[1]), int(match[2])


def coefficients(text: str) -> tuple:
    """Those of plumb_bob from K1,K2,P1,P2,K3."""
    try:
        values = tuple(float(value) for value in text.split(','))
    except ValueError:
        values = ()
    if len(values) != 5 or not all(abs(value) <= 2 for value in values):
        raise argparse.ArgumentTypeError(f"'{text}' is not K1,K2,P1,P2,K3, each -2 to 2")
    return values


def number(low: float, high: float):
    def parse(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(f"'{text}' is not a number from {low:g} to {high:g}")
        return value
    return parse


def whole(low: int, high: int):
    def parse(text: str) -> int:
        if not re.fullmatch('[0-9]{1,10}', text) or not low <= int(text) <= high:
            raise argparse.ArgumentTypeError(f"'{text}' is not a whole number from {low} to {high}")
        return int(text)
    return parse


def parse_arguments() -> argparse.Namespace:
    """The arguments behind Blender's own `--`."""
    arguments = sys.argv[sys.argv.index('--') + 1:] if '--' in sys.argv else []
    parser = argparse.ArgumentParser(prog='render_world.py', description=__doc__.splitlines()[0])
    parser.add_argument('--world', choices=list(DEFAULTS), default='campus', help='(default: %(default)s)')
    parser.add_argument('--seed', type=whole(0, 10**9), default=1,
                        help='another seed is another world (default: %(default)s)')
    parser.add_argument('--day', help='light and parked cars: ' + '; '.join(
        f'{name}: {", ".join(world.days)}' for name, world in DEFAULTS.items()) + ' (default: the first)')
    parser.add_argument('--round', type=whole(0, 10**6), default=0, help='people, path offsets, height of the sun')
    parser.add_argument('--out', type=Path, required=True, help='folder to write to')
    parser.add_argument('--spacing', type=number(.05, 20),
                        help='metres between images (default: 0.65, in the town 1)')
    parser.add_argument('--size', type=image_size, default=(320, 240), help='of the image, pixels (default: 320x240)')
    parser.add_argument('--field-of-view', type=number(10, 120), default=62,
                        help='horizontal and without distortion, degrees (default: %(default)s)')
    parser.add_argument('--distortion', type=coefficients, metavar='K1,K2,P1,P2,K3',
                        help='plumb_bob, written --distortion=-0.28,0.09,0,0,0; also vignetting, exposure and motion '
                        'blur (default: none on the campus, elsewhere as written here)')
    parser.add_argument('--raise', dest='raise_m', type=number(-.9, 20), default=0,
                        help='the camera by so many metres (default: %(default)s)')
    parser.add_argument('--pitch', type=number(-60, 60), help='the camera upwards, degrees (default: in the town 4)')
    parser.add_argument('--samples', type=whole(1, 4096), default=12,
                        help='light samples a pixel (default: %(default)s)')
    parser.add_argument('--first', type=whole(0, 10**9), default=0, help='first frame to render')
    parser.add_argument('--last', type=whole(0, 10**9), default=10**9, help='last frame to render')
    parser.add_argument('--every', type=whole(1, 10**9), default=1, help='render only every so many frames')
    args = parser.parse_args(arguments)
    world = DEFAULTS[args.world]
    args.day = args.day or next(iter(world.days))
    if args.day not in world.days:
        parser.error(f"argument --day: '{args.day}' is not a day of the {args.world}: {', '.join(world.days)}")
    args.spacing = args.spacing or world.spacing_m
    args.pitch = world.pitch_deg if args.pitch is None else args.pitch
    args.distortion = args.distortion or world.distortion
    return args


def pose_row(pose: CameraPose, tilted: bool) -> list:
    """A row of pose.csv. The campus is level and its file has no tilt."""
    row = [pose.index, f'{pose.time_s:.3f}', f'{pose.x_m:.4f}', f'{pose.y_m:.4f}', round(pose.z_m, 4),
           f'{pose.yaw_rad:.5f}']
    return row + [f'{pose.roll_rad:.5f}', f'{-pose.pitch_rad:.5f}'] if tilted else row


def raised(pose: CameraPose, args: argparse.Namespace) -> CameraPose:
    """A pose of the campus, with the camera higher and pitched."""
    return replace(pose, z_m=round(pose.z_m + args.raise_m, 4), pitch_rad=pose.pitch_rad + math.radians(args.pitch))


def main() -> None:
    """Builds the world and drives one round."""
    args = parse_arguments()
    try:
        lens = Lens(args.size, args.field_of_view, args.distortion or PINHOLE)
    except ValueError as error:
        raise SystemExit(f'render_world: --distortion: {error}') from error
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    spec = Spec(args.seed, args.day, args.round, args.spacing, args.raise_m, math.radians(args.pitch))
    world = importlib.import_module(f'worlds.{args.world}')
    drive = world.build(scene, spec)

    args.out.mkdir(parents=True, exist_ok=True)
    write_calibration(args.out / FILE_NAME, lens)
    tilted = args.world != 'campus'
    if args.distortion:
        from worlds.sensor import SensorCamera  # needs OpenCV
        camera = SensorCamera(scene, lens, args.samples, DEFAULTS[args.world].days[args.day], drive, args.out)
        camera.meter(args.spacing / IMAGE_PERIOD_S)
    else:
        camera = PlainCamera(scene, args.field_of_view, args.size, args.samples)
    with open(args.out / 'pose.csv', 'w', newline='', encoding='utf-8') as file:
        writer = csv.writer(file)
        writer.writerow(['index', 't', 'x', 'y', 'z', 'yaw'] + (['roll', 'pitch'] if tilted else []))
        for pose in drive.poses():
            pose = pose if tilted else raised(pose, args)
            writer.writerow(pose_row(pose, tilted))
            if args.first <= pose.index <= args.last and pose.index % args.every == 0:
                path = args.out / f'frame_{pose.index:04d}.png'
                if args.distortion:
                    camera.take(pose, pose.index * args.spacing, args.spacing / IMAGE_PERIOD_S, path)
                else:
                    camera.take(pose, path)
    print(f'{drive.count} frames, {drive.length_m:.1f} m')


if __name__ == '__main__':
    main()
