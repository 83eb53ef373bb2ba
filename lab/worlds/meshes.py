"""Small helpers around Blender's data: materials and simple bodies."""
import math
from typing import Sequence, Tuple

import bpy
import numpy as np


def image_from(array: np.ndarray, name: str) -> 'bpy.types.Image':
    """Packs an array of rows from the top, grey or RGB, into a Blender image."""
    height, width = array.shape[:2]
    image = bpy.data.images.new(name, width, height, alpha=False)
    rgba = np.ones((height, width, 4), np.float32)
    rgba[..., :3] = array if array.ndim == 3 else array[..., None]
    image.pixels.foreach_set(rgba[::-1].ravel())
    image.pack()
    return image


def image_material(array: np.ndarray, name: str, roughness: float = .9) -> 'bpy.types.Material':
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    nodes = material.node_tree.nodes
    texture = nodes.new('ShaderNodeTexImage')
    texture.image = image_from(array, name)
    surface = nodes['Principled BSDF']
    surface.inputs['Roughness'].default_value = roughness
    surface.inputs['Specular'].default_value = .1
    material.node_tree.links.new(texture.outputs['Color'], surface.inputs['Base Color'])
    return material


def flat_material(rgb: Sequence[float], name: str, roughness: float = .7,
                  specular: float = .2) -> 'bpy.types.Material':
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    surface = material.node_tree.nodes['Principled BSDF']
    surface.inputs['Base Color'].default_value = (*rgb, 1)
    surface.inputs['Roughness'].default_value = roughness
    surface.inputs['Specular'].default_value = specular
    return material


def quad(corners: Sequence[Tuple[float, float, float]], material: 'bpy.types.Material') -> None:
    """A rectangle; the texture's lower left corner is the first corner."""
    mesh = bpy.data.meshes.new('quad')
    mesh.from_pydata(corners, [], [(0, 1, 2, 3)])
    layer = mesh.uv_layers.new()
    for k, uv in enumerate(((0, 0), (1, 0), (1, 1), (0, 1))):
        layer.data[k].uv = uv
    mesh.materials.append(material)
    bpy.context.scene.collection.objects.link(bpy.data.objects.new('quad', mesh))


def box(x: float, y: float, bottom: float, size: Tuple[float, float, float], yaw: float,
        material: 'bpy.types.Material') -> None:
    bpy.ops.mesh.primitive_cube_add(size=1, location=(x, y, bottom + size[2] / 2), rotation=(0, 0, yaw))
    bpy.context.object.scale = size
    bpy.context.object.data.materials.append(material)


def cylinder(centre: Tuple[float, float, float], radius: float, depth: float, material: 'bpy.types.Material',
             vertices: int = 8, rotation: Tuple[float, float, float] = (0, 0, 0)) -> None:
    bpy.ops.mesh.primitive_cylinder_add(vertices=vertices, radius=radius, depth=depth, location=centre,
                                        rotation=rotation)
    bpy.context.object.data.materials.append(material)


def wheel(centre: Tuple[float, float, float], yaw: float, material: 'bpy.types.Material') -> None:
    cylinder(centre, .32, .2, material, 12, (math.pi / 2, 0, yaw))
