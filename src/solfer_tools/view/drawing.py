"""Draws a scene in viser."""

from collections.abc import Mapping, Sequence

import numpy as np
from viser import ArrowsHandle, FrameHandle, LineSegmentsHandle, MeshHandle, SceneApi
from viser._messages import SetOrientationMessage, SetPositionMessage

from solfer.model.urdf.description import Description
from solfer.numerics.rotations import quaternion_from_rotation
from solfer_tools.scene import ScenePose, SceneState, ShownReference, ShownWorld
from solfer_tools.view.visuals import Visual, visuals_of

FORCE_SCALE = 1e-3
"""Length of the arrow of a force [m/N]."""

FORCE_COLOR = (0.9, 0.3, 0.1)

WORLD_COLOR = (0.58, 0.55, 0.50)

LARGEST_AGREEMENT = 2e-3
"""Distance between a desired and a measured link up to which the desired one is not drawn [m]."""

Color = tuple[float, float, float]


class SceneDrawing:
    """A robot and what belongs to it, in a viewer.

    Args:
        api: What is seen there.
        description: The robot.
        world: What it stands on and bumps into.

    Attributes:
        base: The first link that is seen.
    """

    def __init__(self, api: SceneApi, description: Description, world: ShownWorld):
        self._api = api
        self._world = world
        visuals = visuals_of(description)
        api.add_grid("/ground", width=20.0, height=20.0, cell_size=0.5, section_size=1.0)
        for group in (
            "/desired",
            "/center",
            "/support",
            "/path",
            "/forces",
            "/names",
            "/world",
        ):  # a page may hide each
            api.add_frame(group, show_axes=False)
        self.base = next((link for link, surfaces in visuals.items() if surfaces), description.root)
        self._measured = _Links(api, "/measured", visuals)
        self._desired = _Links(api, "/desired/links", visuals, color=(0.3, 0.55, 1.0), opacity=0.3)
        self._center = api.add_icosphere("/center/mass", 0.04, (0.1, 0.4, 0.9))
        self._projection = api.add_icosphere("/center/projection", 0.025, (0.9, 0.2, 0.2))
        self._polygon = _Line(api, "/support/polygon", (0.1, 0.7, 0.2))
        self._inner = _Line(api, "/support/margins", (0.9, 0.7, 0.1))
        self._path = _Line(api, "/path/base", (0.6, 0.2, 0.8))
        self._estimated = _Line(api, "/path/estimated", (0.95, 0.6, 0.2))
        self._forces: ArrowsHandle | None = None
        self._references: dict[str, _Reference] = {}
        self._surfaces: list[MeshHandle] = []

    def update_world(self) -> None:
        """Draw the world where it has changed, in place of what was there."""
        surfaces = self._world.update()
        if surfaces is None:
            return
        for old in self._surfaces:
            old.remove()
        self._surfaces = [
            self._api.add_mesh_simple(
                f"/world/{each.name}",
                each.vertices,
                each.faces,
                color=WORLD_COLOR,
                flat_shading=True,
                side="double",
            )
            for each in surfaces
        ]

    def update(self, state: SceneState) -> None:
        """Draw a scene."""
        self._measured.place(state.measured)
        self._desired.place(state.desired, unlike=state.measured)
        self._center.position = state.center
        self._projection.position = state.projection
        self._polygon.draw(_closed(state.polygon))
        self._inner.draw(_closed(state.inner))
        ground = state.projection[2]
        for line, path in ((self._path, state.path), (self._estimated, state.estimated_path)):
            line.draw(np.column_stack((path[:, :2], np.full(len(path), ground))))
        arrows = [(each.position, each.position + FORCE_SCALE * each.force) for each in state.forces if each.touches]
        self._draw_forces(np.array(arrows, dtype=np.float32).reshape(-1, 2, 3))
        self._draw_references(state.references)

    def _draw_forces(self, arrows: np.ndarray) -> None:
        """Draw arrows, shape (k, 2, 3) [m]; their number is that which they were made with."""
        if self._forces is not None and len(self._forces.points) != len(arrows):
            self._forces.remove()
            self._forces = None
        if self._forces is not None:
            self._forces.points = arrows
        elif len(arrows):
            self._forces = self._api.add_arrows(
                "/forces/arrows", arrows, FORCE_COLOR, shaft_radius=0.012, head_radius=0.03
            )

    def _draw_references(self, references: Sequence[ShownReference]) -> None:
        shown = {name_of(each): each for each in references}
        for name in set(self._references) - set(shown):
            self._references.pop(name).remove()
        for name, reference in shown.items():
            if name not in self._references:
                self._references[name] = _Reference(self._api, name)
            self._references[name].place(reference)


class _Links:
    """The links of a robot."""

    def __init__(
        self,
        api: SceneApi,
        name: str,
        visuals: Mapping[str, Sequence[Visual]],
        color: Color | None = None,
        opacity: float = 1.0,
    ):
        self._send = api._queue_scene_message
        self._root = api.add_frame(name, show_axes=False, visible=False)
        self._frames: list[FrameHandle] = []
        self._links = [link for link, surfaces in visuals.items() if surfaces]
        self._names = [f"{name}/{link}" for link in self._links]
        self._positions = np.full((len(self._links), 3), np.nan)
        self._rotations = np.full((len(self._links), 3, 3), np.nan)
        for link in self._links:
            surfaces = visuals[link]
            self._frames.append(api.add_frame(f"{name}/{link}", show_axes=False))
            for index, surface in enumerate(surfaces):
                seen = surface.color[3] * opacity
                api.add_mesh_simple(
                    f"{name}/{link}/{index}",
                    surface.mesh.vertices,
                    surface.mesh.faces,
                    color=color or surface.color[:3],
                    opacity=None if seen >= 1.0 else seen,
                    flat_shading=True,
                    side="double",
                )

    def place(self, poses: Mapping[str, ScenePose], unlike: Mapping[str, ScenePose] | None = None) -> None:
        """Move the links to their poses; without any none is seen, nor is one that is where it is in `unlike`."""
        self._root.visible = bool(poses)
        if not poses:
            return
        positions = np.array([poses[link].position for link in self._links])
        rotations = np.array([poses[link].rotation for link in self._links])
        if unlike is not None:
            others = np.array([unlike[link].position for link in self._links])
            differs = np.linalg.norm(positions - others, axis=1) > LARGEST_AGREEMENT
            for frame, is_seen in zip(self._frames, differs.tolist(), strict=True):
                frame.visible = is_seen
        change = 1e-4  # of a position [m], or of an entry of a rotation, below which the page is not informed
        # handles would compare each pose with the one before, which takes three times as long as to send it
        for index in np.flatnonzero(~(np.abs(positions - self._positions) < change).all(axis=1)):
            self._positions[index] = positions[index]
            self._send(SetPositionMessage(self._names[index], tuple(positions[index].tolist())))
        for index in np.flatnonzero(~(np.abs(rotations - self._rotations) < change).all(axis=(1, 2))):
            self._rotations[index] = rotations[index]
            x, y, z, w = quaternion_from_rotation(rotations[index]).tolist()
            self._send(SetOrientationMessage(self._names[index], (w, x, y, z)))


class _Line:
    """A line through points."""

    def __init__(self, api: SceneApi, name: str, color: Color):
        nothing = np.zeros((1, 2, 3), dtype=np.float32)
        self._line: LineSegmentsHandle = api.add_line_segments(name, nothing, color, thickness=0.015, visible=False)

    def draw(self, points: np.ndarray) -> None:
        """Draw through points, shape (k, 3) [m]."""
        self._line.visible = len(points) > 1
        if len(points) > 1:
            segments = np.stack((points[:-1], points[1:]), axis=1).astype(np.float32)
            if not np.array_equal(segments, self._line.points):
                self._line.points = segments


class _Reference:
    """Where a reference is, and where it goes."""

    def __init__(self, api: SceneApi, name: str):
        self._frame = api.add_frame(f"/references{name}", axes_length=0.12, axes_radius=0.006)
        self._label = api.add_label(f"/names{name}", name)
        self._goal = api.add_icosphere(f"/goals{name}", 0.02, (0.5, 0.5, 0.5))

    def place(self, reference: ShownReference) -> None:
        """Move it."""
        place(self._frame, reference.reference)
        self._label.position = reference.reference.position
        self._goal.position = reference.desired.position

    def remove(self) -> None:
        """Take it away."""
        for each in (self._label, self._frame, self._goal):
            each.remove()


def name_of(reference: ShownReference) -> str:
    """Return the name of a reference: '/module/task'."""
    return f"/{reference.module.strip('/')}/{reference.task}"


def place(handle: FrameHandle, pose: ScenePose) -> None:
    """Move what is seen to a pose."""
    handle.wxyz = wxyz(pose)
    handle.position = pose.position


def wxyz(pose: ScenePose) -> np.ndarray:
    """Return the quaternion of a pose as viser has it, shape (4,)."""
    return np.roll(quaternion_from_rotation(pose.rotation), 1)


def _closed(corners: np.ndarray) -> np.ndarray:
    return np.concatenate((corners, corners[:1]))
