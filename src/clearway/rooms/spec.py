"""What the rooms ask of MuJoCo's MjSpec: an empty room, materials with textures, meshes."""

from __future__ import annotations

import mujoco
import numpy as np

from clearway.rooms.materials import Look


def empty_spec(name: str, middle_m: tuple[float, float, float]) -> mujoco.MjSpec:
    """A spec with the settings that the rooms are rendered with; `middle_m` is where a free camera looks first."""
    spec = mujoco.MjSpec()
    spec.modelname = name
    spec.visual.quality.offsamples = 4
    spec.visual.quality.shadowsize = 0
    spec.visual.headlight.diffuse[:] = [0, 0, 0]
    spec.visual.headlight.specular[:] = [0, 0, 0]
    spec.visual.headlight.ambient[:] = [0.5, 0.5, 0.5]
    spec.stat.extent = 10.0
    spec.stat.center[:] = middle_m
    spec.visual.map.znear = 0.005  # times the extent: 5 cm
    spec.visual.map.zfar = 5.0
    spec.visual.global_.fovy = 60.0
    return spec


def add_texture(spec: mujoco.MjSpec, name: str, image: np.ndarray) -> str:
    """The name of a new texture from a (height, width, 3) picture in [0, 1], row 0 at the bottom."""
    scaled = image * 255
    pixels = np.clip(np.round(scaled, out=scaled), 0, 255, out=scaled).astype(np.uint8)
    texture = spec.add_texture(
        name=f"{name} texture",
        type=mujoco.mjtTexture.mjTEXTURE_2D,
        height=pixels.shape[0],
        width=pixels.shape[1],
        nchannel=3,
    )
    texture.data = pixels.tobytes()
    return str(texture.name)


def add_material(spec: mujoco.MjSpec, name: str, look: Look) -> None:
    """A material with its texture."""
    material = spec.add_material(
        name=name,
        specular=look.specular,
        shininess=look.shininess,
        emission=look.emission,
        reflectance=look.reflectance,
    )
    material.rgba[:] = [*look.colour, look.alpha]
    if look.image is not None:
        material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = add_texture(spec, name, look.image[::-1])


def add_mesh_geom(
    spec: mujoco.MjSpec,
    name: str,
    arrays: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray],
    material: str,
    group: int,
    body: mujoco.MjsBody | None = None,
) -> mujoco.MjsGeom:
    """A visible geom from a mesh in room coordinates: (V, 3) vertices, (F, 3) faces, (V, 3) normals, (V, 2) uvs.

    It hangs on a body that stands at the room's origin, by default the world's.
    """
    vertices, faces, normals, uvs = arrays
    mesh = spec.add_mesh(name=name, inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL)
    mesh.uservert, mesh.userface = vertices.ravel(), faces.ravel()
    mesh.usernormal, mesh.usertexcoord = normals.ravel(), uvs.ravel()
    return (body or spec.worldbody).add_geom(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_MESH,
        meshname=name,
        material=material,
        group=group,
        contype=0,
        conaffinity=0,
    )
