"""Skies and suns."""
import math
from typing import Sequence, Tuple

import bpy


def _background(scene: 'bpy.types.Scene') -> 'bpy.types.Node':
    world = bpy.data.worlds.new('world')
    scene.world = world
    world.use_nodes = True
    return world.node_tree.nodes['Background']


def add_clear_sky(scene: 'bpy.types.Scene', elevation_deg: float, rotation_deg: float, sun_intensity: float,
                  strength: float) -> None:
    """A sun in a clear sky."""
    background = _background(scene)
    tree = scene.world.node_tree
    sky = tree.nodes.new('ShaderNodeTexSky')
    sky.sky_type = 'NISHITA'
    sky.sun_elevation = math.radians(elevation_deg)
    sky.sun_rotation = math.radians(rotation_deg)
    sky.sun_intensity = sun_intensity
    tree.links.new(sky.outputs['Color'], background.inputs['Color'])
    background.inputs['Strength'].default_value = strength


def add_overcast_sky(scene: 'bpy.types.Scene', strength: float, sun_rotation_rad: float) -> None:
    background = _background(scene)
    background.inputs['Color'].default_value = (.75, .8, .88, 1)
    background.inputs['Strength'].default_value = strength
    sun = bpy.data.lights.new('sun', 'SUN')
    sun.energy = .25
    sun.angle = .9
    lamp = bpy.data.objects.new('sun', sun)
    lamp.rotation_euler = (.7, .3, sun_rotation_rad)
    scene.collection.objects.link(lamp)


def add_clouds(scene: 'bpy.types.Scene', cover: float, brightness: float, seed: int) -> None:
    """Clouds before the sky: `cover` from 0 (none) to 1, `brightness` in units of the sky's colour."""
    tree = scene.world.node_tree
    background = tree.nodes['Background']
    direction, noise = tree.nodes.new('ShaderNodeTexCoord'), tree.nodes.new('ShaderNodeTexNoise')
    noise.noise_dimensions = '4D'
    noise.inputs['W'].default_value = seed % 1000
    noise.inputs['Scale'].default_value = 3.2
    noise.inputs['Detail'].default_value = 8
    noise.inputs['Roughness'].default_value = .62
    tree.links.new(direction.outputs['Generated'], noise.inputs['Vector'])
    thick = tree.nodes.new('ShaderNodeMapRange')
    thick.inputs['From Min'].default_value = .66 - .4 * cover
    thick.inputs['From Max'].default_value = .86 - .4 * cover
    tree.links.new(noise.outputs['Fac'], thick.inputs['Value'])
    mix = tree.nodes.new('ShaderNodeMixRGB')
    mix.inputs['Color2'].default_value = (brightness, brightness, brightness, 1)
    mix.inputs['Color1'].default_value = background.inputs['Color'].default_value
    for link in background.inputs['Color'].links:
        tree.links.new(link.from_socket, mix.inputs['Color1'])
    tree.links.new(thick.outputs['Result'], mix.inputs['Fac'])
    tree.links.new(mix.outputs['Color'], background.inputs['Color'])


def add_lamps(scene: 'bpy.types.Scene', places: Sequence[Tuple[float, float, float]], power_w: float) -> list:
    data = bpy.data.lights.new('lamp', 'SPOT')
    data.energy, data.color = power_w, (1, .75, .45)
    data.spot_size, data.spot_blend, data.shadow_soft_size = math.radians(150), .6, .12
    lamps = []
    for place in places:
        lamp = bpy.data.objects.new('lamp', data)
        lamp.location = place
        scene.collection.objects.link(lamp)
        lamps.append(lamp)
    return lamps


class NearLamps:
    """Only the lamps around the camera are lit: with few samples a pixel, every further one is noise."""

    REACH_M = 28.0

    def __init__(self, lamps: list):
        self._lamps = lamps

    def __call__(self, x: float, y: float) -> None:
        for lamp in self._lamps:
            lamp.hide_render = math.hypot(lamp.location[0] - x, lamp.location[1] - y) > self.REACH_M
