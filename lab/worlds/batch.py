"""Many faces in few meshes: each material becomes one object, so that large worlds load and render quickly."""
import math
from typing import Dict, List, Sequence, Tuple

import bpy
import numpy as np

Corner = Tuple[float, float, float]
Rectangle = Tuple[float, float, float, float]  # u and v of the lower left, u and v of the upper right corner
WHOLE = (0.0, 0.0, 1.0, 1.0)


class _Faces:
    """Quads or triangles of one material."""

    def __init__(self) -> None:
        self.corners: List[np.ndarray] = []
        self.uvs: List[np.ndarray] = []


class Batch:
    """Collects faces by material and makes meshes of them."""

    def __init__(self) -> None:
        self._faces: Dict[Tuple[str, int], _Faces] = {}
        self._materials: Dict[str, 'bpy.types.Material'] = {}

    def faces(self, corners: np.ndarray, material: 'bpy.types.Material', uvs: np.ndarray) -> None:
        """Faces of 3 or 4 corners each: arrays of count x corners x 3 and count x corners x 2."""
        self._materials[material.name] = material
        faces = self._faces.setdefault((material.name, corners.shape[1]), _Faces())
        faces.corners.append(np.asarray(corners, np.float32))
        faces.uvs.append(np.asarray(uvs, np.float32))

    def quad(self, corners: Sequence[Corner], material: 'bpy.types.Material', uv: Rectangle = WHOLE) -> None:
        """A rectangle; the lower left corner of the texture's part is the first corner."""
        u0, v0, u1, v1 = uv
        self.faces(np.array([corners]), material, np.array([[(u0, v0), (u1, v0), (u1, v1), (u0, v1)]]))

    def triangle(self, corners: Sequence[Corner], material: 'bpy.types.Material',
                 uv: Sequence[Tuple[float, float]] = ((0, 0), (1, 0), (.5, 1))) -> None:
        self.faces(np.array([corners]), material, np.array([uv]))

    def box(self, centre: Corner, size: Corner, yaw: float, material: 'bpy.types.Material', taper: float = 1) -> None:
        """A cuboid that stands on `centre`; its upper face may be smaller (`taper`)."""
        lower, upper = frame_corners(centre, size[0], size[1], yaw), frame_corners(
            (centre[0], centre[1], centre[2] + size[2]), size[0] * taper, size[1] * taper, yaw)
        self.prism(lower, upper, material)

    def prism(self, lower: Sequence[Corner], upper: Sequence[Corner], material: 'bpy.types.Material') -> None:
        """The walls between two polygons and the upper one, if it is a quad, as lid."""
        count = len(lower)
        for k in range(count):
            after = (k + 1) % count
            self.quad([lower[k], lower[after], upper[after], upper[k]], material)
        if count == 4:
            self.quad(upper, material)

    def cylinder(self, start: Corner, end: Corner, radius: float, material: 'bpy.types.Material', sides: int = 7,
                 end_radius: float = None) -> None:
        """A tube between two points; thinner at its end when told."""
        axis = np.subtract(end, start)
        axis = axis / np.linalg.norm(axis)
        across = np.cross(axis, (1, 0, 0) if abs(axis[0]) < .8 else (0, 1, 0))
        across /= np.linalg.norm(across)
        turns = np.arange(sides) * 2 * math.pi / sides
        ring = np.cos(turns)[:, None] * across + np.sin(turns)[:, None] * np.cross(axis, across)
        end_radius = radius if end_radius is None else end_radius
        self.prism(list(start + ring * radius), list(end + ring * end_radius), material)

    def disc(self, centre: Corner, normal: Corner, radius: float, material: 'bpy.types.Material') -> None:
        across = np.cross(normal, (0, 0, 1))
        across = across / np.linalg.norm(across) if np.linalg.norm(across) > 1e-6 else np.array([1., 0, 0])
        up = np.cross(across, normal)
        ring = [np.asarray(centre) + radius * (math.cos(a) * across + math.sin(a) * up)
                for a in (math.pi / 8 + k * math.pi / 4 for k in range(8))]
        for a, b, c, d in ((0, 1, 2, 3), (0, 3, 4, 7), (4, 5, 6, 7)):
            self.quad([ring[a], ring[b], ring[c], ring[d]], material)

    def build(self, scene: 'bpy.types.Scene') -> None:
        for (name, sides), faces in self._faces.items():
            corners, uvs = np.concatenate(faces.corners), np.concatenate(faces.uvs)
            count = len(corners)
            mesh = bpy.data.meshes.new(name)
            mesh.vertices.add(count * sides)
            mesh.vertices.foreach_set('co', corners.ravel())
            mesh.loops.add(count * sides)
            mesh.loops.foreach_set('vertex_index', np.arange(count * sides, dtype=np.int32))
            mesh.polygons.add(count)
            mesh.polygons.foreach_set('loop_start', np.arange(0, count * sides, sides, dtype=np.int32))
            mesh.polygons.foreach_set('loop_total', np.full(count, sides, np.int32))
            mesh.uv_layers.new().data.foreach_set('uv', uvs.ravel())
            mesh.update(calc_edges=True)
            mesh.materials.append(self._materials[name])
            scene.collection.objects.link(bpy.data.objects.new(name, mesh))


def frame_corners(centre: Corner, length: float, width: float, yaw: float) -> List[Corner]:
    c, s = math.cos(yaw), math.sin(yaw)
    return [(centre[0] + u * length / 2 * c - v * width / 2 * s, centre[1] + u * length / 2 * s + v * width / 2 * c,
             centre[2]) for u, v in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
