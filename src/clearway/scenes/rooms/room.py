"""`Room`: one room under construction, an MjSpec with its materials, obstacles, lamps, windows and surfaces.

Geom groups: 2 what one sees, 1 the ceiling and what hangs from it, 3 the obstacles (boxes and cylinders, hidden).
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import mujoco
import numpy as np

from clearway.scenes.rooms import meshes
from clearway.scenes.rooms.frame import UPRIGHT, Frame, along, rotation
from clearway.scenes.rooms.materials import SCHEMES, Look, look_of
from clearway.scenes.rooms.surfaces import Surface

CEILING_GROUP, SEEN_GROUP, OBSTACLE_GROUP = 1, 2, 3
WALL_THICKNESS_M = 0.1
NOT_SHADED = ("bulb", "shade", "mirror")
LETS_LIGHT_THROUGH = ("glass", "water", "bulb", "shade")

Point = tuple[float, float, float]
Tilt = tuple[float, float, float, float]
ORIGIN = Frame(0.0, 0.0)


@dataclass(frozen=True)
class Lamp:
    """A lamp that the baked light comes from.

    Attributes:
        centre_m: (3,) middle of the lamp in the room.
        radius_m: the light leaves from a horizontal circle of this size, which softens shadows.
        colour: (3,) of the light.
        power: brightness; a ceiling lamp has about 2.
    """

    centre_m: np.ndarray
    radius_m: float
    colour: np.ndarray
    power: float


@dataclass(frozen=True)
class Window:
    """A window that daylight comes through.

    Attributes:
        centre_m: (3,) middle of the pane.
        normal: (3,) unit vector into the room.
        width_m, height_m: size of the pane.
    """

    centre_m: np.ndarray
    normal: np.ndarray
    width_m: float
    height_m: float


@dataclass(eq=False)
class Part:
    """A visible part of the furniture, as the baked light knows it.

    Attributes:
        geom: its geom in the spec; None for a piece of wall, which is drawn by its surfaces.
        material: name of its material; empty for a piece of wall.
        centre_m, rotation, half_extents_m: its box, (3,), (3, 3), (3,), turned into room coordinates.
        round: it fills the ellipse within its box rather than all of it.
        casts_shadow: light does not pass.
    """

    geom: mujoco.MjsGeom | None
    material: str
    centre_m: np.ndarray
    rotation: np.ndarray
    half_extents_m: np.ndarray
    round: bool
    casts_shadow: bool


@dataclass(eq=False)
class Room:
    """A room under construction. The floor spans 0..width_m in x and 0..depth_m in y; z is up.

    Attributes:
        name: of the room, for messages.
        width_m, depth_m, height_m: size of the floor's bounding rectangle and height of the ceiling.
        grid_origin_m: a point of the navigation grid, (x, y).
        seed: what the generators start from.
        looks: False builds the obstacles alone, in milliseconds.
        mirrored: swap left and right (x to width_m - x) in everything that is placed.
        spec: the MuJoCo model so far.
        rng: for looks: colours, textures, ornaments without obstacles.
        layout_rng: for everything that moves an obstacle; the same with and without looks.
        colours: the scheme of colours.
        lamps, windows, surfaces, parts: what the baked light needs.
    """

    name: str
    width_m: float
    depth_m: float
    height_m: float
    grid_origin_m: tuple[float, float]
    seed: int = 0
    looks: bool = True
    mirrored: bool = False
    spec: mujoco.MjSpec = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Start the spec and the generators."""
        salt = zlib.crc32(self.name.encode())
        self.rng = np.random.default_rng([self.seed, salt, 0])
        self.layout_rng = np.random.default_rng([self.seed, salt, 1])
        self.colours = SCHEMES[(self.seed + salt) % len(SCHEMES)]
        self.lamps: list[Lamp] = []
        self.windows: list[Window] = []
        self.surfaces: list[Surface] = []
        self.parts: list[Part] = []
        self._looks: dict[str, Look] = {}
        self._mesh_names: dict[tuple, str] = {}
        self.spec = _empty_spec(self)
        if self.mirrored:
            self.grid_origin_m = (self.width_m - self.grid_origin_m[0], self.grid_origin_m[1])

    # ------------------------------------------------------------------ places

    def wall(self, side: str, along_m: float, z_m: float = 0.0, gap_m: float = 0.0) -> Frame:
        """A frame on a wall that faces the room: its y points inwards.

        Args:
            side: "south" (y = 0), "north", "west" (x = 0) or "east".
            along_m: x of the place on south and north walls, y on the others.
            z_m: height.
            gap_m: how far in front of the wall.
        """
        return {
            "south": Frame(along_m, gap_m, 0.0, z_m),
            "north": Frame(along_m, self.depth_m - gap_m, 180.0, z_m),
            "west": Frame(gap_m, along_m, -90.0, z_m),
            "east": Frame(self.width_m - gap_m, along_m, 90.0, z_m),
        }[side]

    def _placed(self, frame: Frame, position_m: Point, tilt: Tilt) -> tuple[np.ndarray, np.ndarray]:
        """Room position and quaternion of something in a frame, mirrored where the room is."""
        point, quat = frame.point(*position_m), frame.orientation(tilt)
        if self.mirrored:
            point[0] = self.width_m - point[0]
            quat = quat * np.array([1, 1, -1, -1])
        return point, quat

    def direction(self, frame: Frame, x: float, y: float, z: float) -> np.ndarray:
        """A direction of a frame as a (3,) vector of the room, mirrored where the room is."""
        vector = frame.point(x, y, z) - frame.point(0, 0, 0)
        return vector * np.array([-1, 1, 1]) if self.mirrored else vector

    # --------------------------------------------------------------- obstacles

    def block(self, frame: Frame, centre_m: Point, size_m: Point) -> None:
        """An obstacle: a hidden box of full size `size_m`."""
        self._obstacle(mujoco.mjtGeom.mjGEOM_BOX, frame, centre_m, [side / 2 for side in size_m])

    def post(self, frame: Frame, radius_m: float, height_m: float) -> None:
        """An obstacle: a hidden cylinder that stands on the frame's origin."""
        half_m = height_m / 2
        self._obstacle(mujoco.mjtGeom.mjGEOM_CYLINDER, frame, (0, 0, half_m), [radius_m, half_m, 0.0])

    def _obstacle(self, kind: int, frame: Frame, centre_m: Point, size: Sequence[float]) -> None:
        point, quat = self._placed(frame, centre_m, UPRIGHT)
        geom = self.spec.worldbody.add_geom(
            type=kind, pos=point, quat=quat, group=OBSTACLE_GROUP, contype=1, conaffinity=1
        )
        geom.size[:] = size

    # ------------------------------------------------------------------- parts

    def box(
        self,
        frame: Frame,
        position_m: Point,
        size_m: Point,
        material: str,
        bevel_m: float = 0.008,
        tilt: Tilt = UPRIGHT,
        segments: int = 1,
        grain_up: bool = False,
        group: int = SEEN_GROUP,
    ) -> None:
        """A bevelled box; `position_m` is the middle of its underside, `size_m` its full size."""
        if self.looks:
            size = tuple(round(float(side), 4) for side in size_m)
            mesh = meshes.bevelled_box(size, bevel_m, segments, grain_up)
            x, y, z = position_m
            self._add(mesh, frame, (x, y, z + size_m[2] / 2), material, tilt, group)

    def turned(
        self,
        frame: Frame,
        position_m: Point,
        profile_m: Sequence[tuple[float, float]],
        material: str,
        tilt: Tilt = UPRIGHT,
        scale_xy: tuple[float, float] = (1.0, 1.0),
        slices: int = 20,
        group: int = SEEN_GROUP,
    ) -> None:
        """A lathed shape from (radius, height) points; heights count from `position_m`."""
        if self.looks:
            mesh = meshes.lathe(tuple((float(r), float(z)) for r, z in profile_m), slices, scale_xy)
            self._add(mesh, frame, position_m, material, tilt, group, round_shape=True)

    def cylinder(
        self,
        frame: Frame,
        position_m: Point,
        radius_m: float,
        height_m: float,
        material: str,
        tilt: Tilt = UPRIGHT,
        group: int = SEEN_GROUP,
    ) -> None:
        """An upright cylinder; `position_m` is the middle of its underside."""
        profile = [(0.0, 0.0), (radius_m, 0.0), (radius_m, height_m), (0.0, height_m)]
        slices = 8 if radius_m < 0.025 else 16 if radius_m < 0.1 else 24
        self.turned(frame, position_m, profile, material, tilt, slices=slices, group=group)

    def rod(
        self, frame: Frame, start_m: Point, end_m: Point, radius_m: float, material: str, group: int = SEEN_GROUP
    ) -> None:
        """A round bar between two points of the frame."""
        axis = np.subtract(end_m, start_m)
        length = round(float(np.linalg.norm(axis)), 4)
        self.cylinder(frame, start_m, radius_m, length, material, along(axis), group)

    def ball(
        self, frame: Frame, centre_m: Point, radii_m: Point, material: str, tilt: Tilt = UPRIGHT, slices: int = 12,
        group: int = SEEN_GROUP,
    ) -> None:  # fmt: skip
        """An ellipsoid with half-axes `radii_m`."""
        angles = np.linspace(-np.pi / 2, np.pi / 2, max(4, slices // 2 + 1))
        widest = round(max(radii_m[0], radii_m[1]), 4)
        profile = [(max(0.0, widest * np.cos(a)), radii_m[2] * np.sin(a)) for a in angles]
        profile[0], profile[-1] = (0.0, profile[0][1]), (0.0, profile[-1][1])
        scale = (radii_m[0] / widest, radii_m[1] / widest)
        self.turned(frame, centre_m, profile, material, tilt, scale, slices, group)

    def picture(
        self,
        frame: Frame,
        centre_m: Point,
        size_m: tuple[float, float],
        make: Callable[[np.random.Generator], np.ndarray] | str,
        tilt: Tilt = UPRIGHT,
        **look: float,
    ) -> None:
        """A flat picture (width, height) that faces the frame's +y, made by a function or given as a material."""
        if self.looks:
            material = make if isinstance(make, str) else self._one_off(Look(make(self.rng), **look))
            mesh = meshes.panel(round(size_m[0], 4), round(size_m[1], 4))
            self._add(mesh, frame, centre_m, material, tilt, SEEN_GROUP, stretch=True)

    def cloth(self, frame: Frame, position_m: Point, size_m: tuple[float, float], folds: int, material: str) -> None:
        """A hanging cloth (width, height) in waves; `position_m` is the middle of its lower hem."""
        if self.looks:
            mesh = meshes.curtain(round(size_m[0], 4), round(size_m[1], 4), folds)
            x, y, z = position_m
            self._add(mesh, frame, (x, y, z + size_m[1] / 2), material, UPRIGHT, SEEN_GROUP)

    def _add(
        self,
        mesh: meshes.Mesh,
        frame: Frame,
        position_m: Point,
        material: str,
        tilt: Tilt,
        group: int,
        round_shape: bool = False,
        stretch: bool = False,
    ) -> None:
        """Place a mesh and note it for the light."""
        look = self._look(material)
        size_m = (1.0, 1.0) if stretch else look.size_m
        moves_grain = look.image is not None and not stretch
        shift = tuple(self.rng.integers(0, 4, 2) / 4) if moves_grain else (0.0, 0.0)
        point, quat = self._placed(frame, position_m, tilt)
        geom = self.spec.worldbody.add_geom(
            type=mujoco.mjtGeom.mjGEOM_MESH, meshname=self._mesh_name(mesh, size_m, shift), material=material,
            pos=point, quat=quat, group=group, contype=0, conaffinity=0,
        )  # fmt: skip
        turned = rotation(quat)
        casts = material not in LETS_LIGHT_THROUGH and look.alpha == 1.0
        self.parts.append(
            Part(geom, material, point + turned @ mesh.centre_m, turned, mesh.half_extents_m, round_shape, casts)
        )

    def _mesh_name(self, mesh: meshes.Mesh, size_m: tuple[float, float], shift: tuple[float, float]) -> str:
        """The name of the mesh in the spec, added the first time it is asked for."""
        key = (mesh, size_m, shift)
        if key not in self._mesh_names:
            self._mesh_names[key] = f"mesh {len(self._mesh_names)}"
            add_mesh(self.spec, self._mesh_names[key], mesh, mesh.uvs / size_m + shift)
        return self._mesh_names[key]

    def shadow_box(self, frame: Frame, size_m: Point) -> None:
        """A box on the frame's origin that stops light and is drawn by other means: a partition."""
        point, quat = self._placed(frame, (0, 0, size_m[2] / 2), UPRIGHT)
        self.parts.append(Part(None, "", point, rotation(quat), np.array(size_m) / 2, False, True))

    def mirror_glass(self, frame: Frame, centre_m: Point, size_m: tuple[float, float]) -> None:
        """A mirror (width, height) that faces the frame's +y; MuJoCo mirrors in the top of a box only."""
        if self.looks:
            self._look("mirror")
            to_front = (np.sqrt(0.5), -np.sqrt(0.5), 0.0, 0.0)
            point, quat = self._placed(frame, centre_m, to_front)
            geom = self.spec.worldbody.add_geom(
                type=mujoco.mjtGeom.mjGEOM_BOX, pos=point, quat=quat, group=SEEN_GROUP, material="mirror",
                contype=0, conaffinity=0,
            )  # fmt: skip
            geom.size[:] = [size_m[0] / 2, size_m[1] / 2, 0.008]

    # --------------------------------------------------------------- materials

    def _look(self, name: str) -> Look:
        """The look of a material, added to the spec the first time it is asked for."""
        if name not in self._looks:
            rng = np.random.default_rng([self.seed, zlib.crc32(f"{self.name} {name}".encode()), 2])
            self._looks[name] = look_of(name, rng, self.colours)
            add_material(self.spec, name, self._looks[name])
        return self._looks[name]

    def _one_off(self, look: Look) -> str:
        """A material for one part only."""
        name = f"picture {len(self._looks)}"
        self._looks[name] = look
        add_material(self.spec, name, look)
        return name

    def tint_of(self, name: str) -> np.ndarray:
        """(4,) colour of a material under full light."""
        look = self._looks[name]
        colour = (1.0, 1.0, 1.0) if look.image is not None else look.colour
        return np.array([*colour, look.alpha])

    def is_shaded(self, name: str) -> bool:
        """Whether a material takes the baked light: lamps, mirrors and window views shine by themselves."""
        look = self._looks[name]
        return name not in NOT_SHADED and look.emission < 0.5


def add_material(spec: mujoco.MjSpec, name: str, look: Look) -> None:
    """A material with its texture in the spec."""
    material = spec.add_material(
        name=name, specular=look.specular, shininess=look.shininess, emission=look.emission,
        reflectance=look.reflectance,
    )  # fmt: skip
    if look.image is None:
        material.rgba[:] = [*look.colour, look.alpha]
        return
    pixels = np.clip(np.round(look.image[::-1] * 255), 0, 255).astype(np.uint8)
    texture = spec.add_texture(
        name=f"{name} texture", type=mujoco.mjtTexture.mjTEXTURE_2D, height=pixels.shape[0], width=pixels.shape[1],
        nchannel=3,
    )  # fmt: skip
    texture.data = pixels.tobytes()
    material.rgba[:] = [1, 1, 1, look.alpha]
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = texture.name


def add_mesh(spec: mujoco.MjSpec, name: str, mesh: meshes.Mesh, uvs: np.ndarray) -> None:
    """A mesh in the spec with texture coordinates in repeats of its picture."""
    item = spec.add_mesh(name=name)
    item.uservert = mesh.vertices_m.ravel()
    item.userface = mesh.faces.ravel()
    item.usernormal = mesh.normals.ravel()
    item.usertexcoord = uvs.ravel()
    item.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL


def _empty_spec(room: Room) -> mujoco.MjSpec:
    """A spec with the settings that the rooms are rendered with."""
    spec = mujoco.MjSpec()
    spec.modelname = room.name
    spec.visual.quality.offsamples = 4
    spec.visual.quality.shadowsize = 0
    spec.visual.headlight.diffuse[:] = [0, 0, 0]
    spec.visual.headlight.specular[:] = [0, 0, 0]
    spec.visual.headlight.ambient[:] = [0.4, 0.4, 0.4]
    spec.stat.extent = 10.0
    spec.stat.center[:] = [room.width_m / 2, room.depth_m / 2, 1.0]
    spec.visual.map.znear = 0.005  # times the extent: 5 cm
    spec.visual.map.zfar = 5.0
    spec.visual.global_.fovy = 60.0
    return spec
