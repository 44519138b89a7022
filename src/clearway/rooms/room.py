"""`Room`: one room under construction, an MjSpec with its materials, obstacles, lamps, windows and surfaces.

Geom groups: 2 what one sees, 1 the ceiling and what hangs from it, 3 the obstacles (boxes and cylinders, hidden).
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field

import mujoco
import numpy as np

from clearway.rooms import meshes
from clearway.rooms.daytime import NOON, Daytime
from clearway.rooms.detail import FULL, Detail
from clearway.rooms.frame import UPRIGHT, Frame, along, rotation
from clearway.rooms.groups import OBSTACLE_GROUP, PIECE_NAME, SEEN_GROUP
from clearway.rooms.materials import SCHEMES, Look, look_of
from clearway.rooms.parts import Lamp, Part, Window
from clearway.rooms.spec import add_material, empty_spec
from clearway.rooms.surfaces import Surface

WALL_THICKNESS_M = 0.1
NOT_SHADED = ("bulb", "shade", "mirror")
LETS_LIGHT_THROUGH = ("glass", "water", "bulb", "shade")

Point = tuple[float, float, float]
Tilt = tuple[float, float, float, float]
ORIGIN = Frame(0.0, 0.0)


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
        detail: how finely it is modelled and lit.
        daytime: the light outside.
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
    detail: Detail = FULL
    daytime: Daytime = NOON
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
        self._piece_number = -1
        self._piece: int | None = None  # obstacles of the present piece, so far
        self._looks: dict[str, Look] = {}
        self.spec = empty_spec(self.name, (self.width_m / 2, self.depth_m / 2, 1.0))
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

    def place(self, frame: Frame, position_m: Point) -> np.ndarray:
        """Room coordinates (3,) of a point in a frame, mirrored where the room is."""
        return self._placed(frame, position_m, UPRIGHT)[0]

    def direction(self, frame: Frame, x: float, y: float, z: float) -> np.ndarray:
        """A direction of a frame as a (3,) vector of the room, mirrored where the room is."""
        vector = frame.point(x, y, z) - frame.point(0, 0, 0)
        return vector * np.array([-1, 1, 1]) if self.mirrored else vector

    # --------------------------------------------------------------- obstacles

    def block(self, frame: Frame, centre_m: Point, size_m: Point, name: str = "") -> None:
        """An obstacle: a hidden box of full size `size_m`; parts of the shell have a name (`pieces`)."""
        self._obstacle(mujoco.mjtGeom.mjGEOM_BOX, frame, centre_m, [side / 2 for side in size_m], name)

    def post(self, frame: Frame, radius_m: float, height_m: float) -> None:
        """An obstacle: a hidden cylinder that stands on the frame's origin."""
        half_m = height_m / 2
        self._obstacle(mujoco.mjtGeom.mjGEOM_CYLINDER, frame, (0, 0, half_m), [radius_m, half_m, 0.0])

    @contextmanager
    def one_piece(self) -> Iterator[None]:
        """Obstacles that are added meanwhile belong to one piece of furniture; those on the floor are moved as one."""
        self._piece_number, self._piece = self._piece_number + 1, 0
        try:
            yield
        finally:
            self._piece = None

    def _obstacle(self, kind: int, frame: Frame, centre_m: Point, size: Sequence[float], name: str = "") -> None:
        point, quat = self._placed(frame, centre_m, UPRIGHT)
        if self._piece is not None:
            name, self._piece = f"{PIECE_NAME} {self._piece_number}/{self._piece}", self._piece + 1
        geom = self.spec.worldbody.add_geom(
            name=name, type=kind, pos=point, quat=quat, group=OBSTACLE_GROUP, contype=1, conaffinity=1
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
            mesh = meshes.bevelled_box(size, bevel_m, self.detail.segments(bevel_m, segments), grain_up)
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
            profile = tuple((float(r), float(z)) for r, z in profile_m)
            mesh = meshes.lathe(profile, min(slices, self.detail.most_slices), scale_xy)
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
        self,
        frame: Frame,
        centre_m: Point,
        radii_m: Point,
        material: str,
        tilt: Tilt = UPRIGHT,
        slices: int = 12,
        group: int = SEEN_GROUP,
    ) -> None:
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
        make: Callable[[np.random.Generator, int], np.ndarray],
        specular: float = 0.1,
        shininess: float = 0.3,
        emission: float = 0.0,
    ) -> None:
        """A flat picture (width, height) that faces the frame's +y; `make` is given the detail's `texture_step`."""
        if self.looks:
            look = Look(
                make(self.rng, self.detail.texture_step), specular=specular, shininess=shininess, emission=emission
            )
            material = self._one_off(look)
            mesh = meshes.panel(round(size_m[0], 4), round(size_m[1], 4))
            self._add(mesh, frame, centre_m, material, UPRIGHT, SEEN_GROUP, stretch=True)

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
        """Place a mesh; the grain of a material that has one starts at a random place."""
        look = self._look(material)
        uvs = mesh.uvs
        if not stretch:
            shift = self.rng.random(2) if look.image is not None else np.zeros(2)
            uvs = mesh.uvs / look.size_m + shift
        point, quat = self._placed(frame, position_m, tilt)
        casts = material not in LETS_LIGHT_THROUGH and look.alpha == 1.0
        self.parts.append(Part(mesh, uvs, material, group, point, rotation(quat), round_shape, casts))

    def shadow_box(self, frame: Frame, size_m: Point) -> None:
        """A box on the frame's origin that stops light and is drawn by other means: a partition."""
        mesh = meshes.bevelled_box(size_m, 0.0, 0)
        point, quat = self._placed(frame, (0, 0, size_m[2] / 2), UPRIGHT)
        self.parts.append(Part(mesh, mesh.uvs, "", SEEN_GROUP, point, rotation(quat), False, True))

    def mirror_glass(self, frame: Frame, centre_m: Point, size_m: tuple[float, float]) -> None:
        """A mirror (width, height) that faces the frame's +y; MuJoCo mirrors in the top of a box only."""
        if self.looks:
            self._look("mirror")
            to_front = (np.sqrt(0.5), -np.sqrt(0.5), 0.0, 0.0)
            point, quat = self._placed(frame, centre_m, to_front)
            geom = self.spec.worldbody.add_geom(
                type=mujoco.mjtGeom.mjGEOM_BOX,
                pos=point,
                quat=quat,
                group=SEEN_GROUP,
                material="mirror",
                contype=0,
                conaffinity=0,
            )
            geom.size[:] = [size_m[0] / 2, size_m[1] / 2, 0.008]

    # --------------------------------------------------------------- materials

    def _look(self, name: str) -> Look:
        """The look of a material, added to the spec the first time it is asked for."""
        if name not in self._looks:
            rng = np.random.default_rng([self.seed, zlib.crc32(f"{self.name} {name}".encode()), 2])
            self._looks[name] = look_of(name, rng, self.colours, self.detail.texture_step)
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

    def is_opaque(self, name: str) -> bool:
        """Whether nothing shows through a material."""
        return self._looks[name].alpha == 1.0

    def is_shaded(self, name: str) -> bool:
        """Whether a material takes the baked light: lamps, mirrors and window views shine by themselves."""
        look = self._looks[name]
        return name not in NOT_SHADED and look.emission < 0.5
