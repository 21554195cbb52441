"""The machine in 3D: base, platform, legs in the colour of a number, the load as it is and as it is estimated."""

from types import ModuleType
from typing import Any, Literal

import numpy as np
import viser
from numpy.typing import NDArray

from hexload.view import colours
from hexload.view.body import ROUGHEST, Body, body_of_estimate, body_of_theta
from hexload.view.frame import SIGMAS, Frame

Array = NDArray[np.float64]
LegColour = Literal["force", "stroke margin"]
GRID_M = 0.2
CORNERS = np.array([(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
BOX_EDGES = np.array([(a, b) for a in CORNERS for b in CORNERS if (b - a > 0).sum() == 1 and (b - a < 0).sum() == 0])


class Scene:
    """Draws a frame; keeps the last pose where a frame has none."""

    def __init__(self, server: viser.ViserServer, native: ModuleType, platform: Any, force_range_n: tuple):
        self._scene, self._native, self._platform = server.scene, native, platform
        self.leg_colour: LegColour = "force"
        self._force_range_n = force_range_n
        self._base, self._hinges = platform.base_hinges_m, platform.platform_hinges_m
        self._radius = float(np.linalg.norm(self._hinges[:, :2], axis=1).max())
        self._home = np.array([0.0, 0.0, platform.home_height_m])
        self._scene.set_up_direction("+z")
        self._scene.configure_environment_map(hdri=None)  # else the page comes up late, and fades in
        self._scene.configure_default_lights(cast_shadow=False)
        self._scene.add_light_ambient("/ambient", intensity=2.2)
        self._add_base(server)
        self._add_platform()
        self._legs = [self._add_leg(leg) for leg in range(6)]
        self._true = _LoadShape(self._scene, "true", colours.TRUTH, self._radius)
        self._estimated = _LoadShape(self._scene, "estimated", colours.ESTIMATE, self._radius)
        self.show(Frame(0.0, displacement_m=np.zeros(6)))

    def _add_base(self, server: viser.ViserServer) -> None:
        reach = float(np.linalg.norm(self._base[:, :2], axis=1).max())
        size = 2.0 * GRID_M * np.ceil(1.6 * reach / GRID_M)
        self._scene.add_grid(
            "/floor", size, size, cell_size=GRID_M, section_size=size / 2, cell_color=colours.FLOOR,
            section_color=colours.FLOOR, shadow_opacity=0.0, position=(0, 0, -0.04 * reach),
        )  # fmt: skip
        _add_plate(self._scene, "/base", self._base, 0.03 * reach, colours.MACHINE)
        height = self._home[2]
        server.initial_camera.fov = np.deg2rad(40)
        server.initial_camera.look_at = (0.0, 0.0, 0.8 * height)
        server.initial_camera.position = tuple(np.array([1.48, -2.03, 0.98]) * (height + reach))

    def _add_platform(self) -> None:
        length = 0.45 * self._radius
        thickness = 0.05 * self._radius
        self._frame = self._scene.add_frame("/platform", axes_length=length, axes_radius=0.014 * self._radius)
        for name, axis in zip("xyz", np.eye(3)):
            self._scene.add_label(f"/platform/{name}", name, position=1.15 * length * axis, anchor="center-center")
        _add_plate(self._scene, "/platform/plate", self._hinges, thickness, colours.MACHINE)

    def _add_leg(self, leg: int) -> tuple:
        shortest, longest = (float(self._platform.home_leg_length_m[leg]) + part for part in self._platform.stroke_m)
        rod_m = 0.97 * shortest
        barrel_m = min(longest - rod_m, rod_m)
        thick = 0.055 * self._radius
        barrel = self._scene.add_cylinder(f"/leg{leg + 1}/barrel", thick, barrel_m)
        rod = self._scene.add_cylinder(f"/leg{leg + 1}/rod", 0.6 * thick, rod_m, color=(200, 205, 210))
        self._scene.add_icosphere(f"/leg{leg + 1}/foot", 1.3 * thick, colours.INK, position=self._base[leg])
        self._scene.add_icosphere(f"/platform/head{leg + 1}", 1.1 * thick, colours.INK, position=self._hinges[leg])
        out = 1.17 * self._base[leg]
        self._scene.add_label(f"/leg{leg + 1}/name", str(leg + 1), position=out, anchor="center-center")
        return barrel, barrel_m, rod, rod_m

    def pose(self, displacement_m: Array) -> tuple[Array, Array] | None:
        """Of the platform's axes in base axes, by the plant's forward kinematics; None: there is none."""
        try:
            position, rotation = self._native.forward_kinematics(self._platform, displacement_m)
        except ValueError:
            return None
        return self._home + position, rotation

    def show(self, frame: Frame) -> None:
        if frame.displacement_m is not None and np.isfinite(frame.displacement_m).all():
            if (pose := self.pose(frame.displacement_m)) is not None:
                self._move(*pose)
            self._colour_legs(frame)
        truth = frame.truth
        true_body = None if truth is None else body_of_theta(self._native, truth.theta, np.zeros(10))
        self._true.show(true_body, filled=True)
        estimate = frame.estimate
        numbers = None if estimate is None else (estimate.names, estimate.value, estimate.sigma)
        known_mass_kg = self._platform.known_mass_kg
        body = None if numbers is None else body_of_estimate(self._native, *numbers, known_mass_kg)
        self._estimated.show(body, filled=true_body is None)  # faces in the same place would flicker

    def _move(self, position: Array, rotation: Array) -> None:
        self._frame.position, self._frame.wxyz = position, quaternion(rotation)
        heads = position + self._hinges @ rotation.T
        for (barrel, barrel_m, rod, rod_m), foot, head in zip(self._legs, self._base, heads):
            along = (head - foot) / np.linalg.norm(head - foot)
            barrel.wxyz = rod.wxyz = quaternion(_turned_to(along))
            barrel.position = foot + along * barrel_m / 2
            rod.position = head - along * rod_m / 2

    def legend(self) -> tuple[str, float, float]:
        """What the legs' colours mean: words with unit, lowest, highest."""
        if self.leg_colour == "force":
            return "leg force, N (+ pushes)", *self._force_range_n
        low, high = self._platform.stroke_m
        return "stroke left, mm", 0.0, 500.0 * (high - low)

    def widen(self, force_n: Array) -> bool:
        """Whether the colours' range had to grow for these forces."""
        low, high = self._force_range_n
        wide = (min(low, float(np.nanmin(force_n))), max(high, float(np.nanmax(force_n))))
        self._force_range_n = wide
        return wide != (low, high)

    def _colour_legs(self, frame: Frame) -> None:
        _, low, high = self.legend()
        if self.leg_colour == "force":
            numbers = np.full(6, np.nan) if frame.force_n is None else frame.force_n
        else:
            shortest, longest = self._platform.stroke_m
            numbers = 1e3 * np.minimum(frame.displacement_m - shortest, longest - frame.displacement_m)
        for (barrel, *_), number in zip(self._legs, numbers):
            colour = colours.of_number(number, low, high)
            if tuple(barrel.color) != colour:
                barrel.color = colour


class _LoadShape:
    """Centre of mass, its ellipsoid, and the box with the load's mass and inertia, in the platform's axes."""

    def __init__(self, scene: Any, name: str, colour: colours.Rgb, radius: float):
        root = f"/platform/{name}"
        self._largest = ROUGHEST * radius
        self._box = scene.add_box(f"{root}/box", colour, opacity=0.2, visible=False)
        self._edges = scene.add_line_segments(
            f"{root}/edges", BOX_EDGES, colour, thickness=2.5, thickness_units="screen", visible=False
        )
        self._point = scene.add_icosphere(f"{root}/com", 0.035 * radius, colour, visible=False)
        self._ellipsoid = scene.add_icosphere(
            f"{root}/ellipsoid", 1.0, colour, opacity=0.22, visible=False, receive_shadow=False
        )

    def show(self, body: Body | None, filled: bool) -> None:
        has_com = body is not None and body.mass_kg > 0.0 and np.abs(body.com_m).max() < self._largest
        self._point.visible = has_com
        has_box = has_com and body.box_m is not None and body.box_m.max() < self._largest
        self._edges.visible, self._box.visible = has_box, has_box and filled
        half_axes = SIGMAS * body.com_sigma_m if has_com else np.zeros(3)
        self._ellipsoid.visible = bool(half_axes.any()) and half_axes.max() < self._largest
        if not has_com:
            return
        self._point.position = self._ellipsoid.position = self._box.position = body.com_m
        if self._ellipsoid.visible:
            self._ellipsoid.scale = tuple(np.maximum(half_axes, 1e-4))
        if has_box:
            self._box.scale = tuple(body.box_m)
            self._box.wxyz = quaternion(body.box_axes)
            self._edges.points = BOX_EDGES * body.box_m @ body.box_axes.T + body.com_m


def _add_plate(scene: Any, name: str, hinges: Array, thickness: float, colour: colours.Rgb) -> None:
    """A prism below the hinges' outline."""
    around = hinges[np.argsort(np.arctan2(hinges[:, 1], hinges[:, 0]))]
    shift = np.array([0.0, 0.0, -thickness])
    count = len(around)
    corners = np.concatenate((around, around + shift))
    faces = [(0, k, k + 1) for k in range(1, count - 1)]
    faces += [(count, count + k, count + k + 1) for k in range(1, count - 1)]
    for k in range(count):
        after = (k + 1) % count
        faces += [(k, after, count + k), (after, count + after, count + k)]
    scene.add_mesh_simple(name, corners, np.array(faces), color=colour, opacity=0.85, side="double", flat_shading=True)


def _turned_to(direction: Array) -> Array:
    """A rotation that takes z to this unit vector."""
    helper = np.array([1.0, 0.0, 0.0]) if abs(direction[0]) < 0.9 else np.array([0.0, 1.0, 0.0])
    x = np.cross(helper, direction)
    x /= np.linalg.norm(x)
    return np.stack((x, np.cross(direction, x), direction), axis=1)


def quaternion(rotation: Array) -> Array:
    return viser.transforms.SO3.from_matrix(rotation).wxyz
