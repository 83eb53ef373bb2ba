"""Skies and suns."""
import math

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
    """An even sky and a sun behind clouds."""
    background = _background(scene)
    background.inputs['Color'].default_value = (.75, .8, .88, 1)
    background.inputs['Strength'].default_value = strength
    sun = bpy.data.lights.new('sun', 'SUN')
    sun.energy = .25
    sun.angle = .9
    lamp = bpy.data.objects.new('sun', sun)
    lamp.rotation_euler = (.7, .3, sun_rotation_rad)
    scene.collection.objects.link(lamp)
