"""Pictures of a world, drawn by OpenGL without a display."""

from typing import Any

from solfer.errors import MissingDependency, SimulationError
from solfer.installation import pip_install
from solfer.simulation.mujoco.library import load_opengl
from solfer.simulation.mujoco.world import MujocoWorld
from solfer.simulation.physics import CameraView, Picture

SEEN = 1
"""MuJoCo's group of shapes that are seen: it has those of `<visual>` in this one."""


class MujocoCamera:
    """Draws a world without a display and without a graphics card.

    Args:
        world: The world.
    """

    def __init__(self, world: MujocoWorld):
        self._world = world
        self._renderer: Any = None
        self._drawn: Any = None

    def light(self) -> None:
        """Light the world: from above, with shadows, and from everywhere."""
        world = self._world
        world.change()
        world.spec.worldbody.add_light(
            type=world.mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
            dir=(-0.27, -0.18, -0.9),
            diffuse=(0.5, 0.5, 0.5),
            specular=(0.1, 0.1, 0.1),
            castshadow=True,
        )
        ambient = world.spec.visual.headlight
        ambient.ambient[:] = 0.5
        ambient.diffuse[:] = 0.15
        ambient.specular[:] = 0.0

    def draw(self, view: CameraView) -> Picture:
        """Draw what a camera sees, see `PhysicsEngine.render`.

        Raises:
            MissingDependency: What draws is not installed.
        """
        world = self._world
        mujoco, model = world.mujoco, world.model
        renderer = self._made(model, view.size)
        model.vis.global_.fovy = view.field_of_view
        camera = mujoco.MjvCamera()
        camera.lookat[:] = view.target
        camera.distance = view.distance
        camera.azimuth = 90.0 + view.yaw
        camera.elevation = view.pitch
        data = world.probe()
        mujoco.mj_comPos(model, data)
        mujoco.mj_camlight(model, data)
        option = mujoco.MjvOption()
        option.geomgroup[:] = 0
        option.geomgroup[SEEN] = 1
        renderer.update_scene(data, camera, scene_option=option)
        colours = renderer.render()
        renderer.enable_depth_rendering()
        depth = renderer.render()
        renderer.disable_depth_rendering()
        farthest = 0.99 * model.vis.map.zfar * model.stat.extent
        return Picture(colours, depth, is_empty=depth > farthest)

    def close(self) -> None:
        """Release what draws. May be called twice."""
        if self._renderer is not None:
            self._renderer.close()
            self._renderer = None

    def _made(self, model: Any, size: tuple[int, int]) -> Any:
        """Make what draws pictures of a size."""
        if self._drawn != (model, size):
            self.close()
            width, height = size
            buffer = model.vis.global_
            buffer.offwidth = max(width, buffer.offwidth)
            buffer.offheight = max(height, buffer.offheight)
            try:
                load_opengl()
                self._renderer = self._world.mujoco.Renderer(model, height, width)
            except ImportError as error:
                raise MissingDependency("pictures of MuJoCo need PyOpenGL", expected=pip_install("PyOpenGL")) from error
            except Exception as error:
                expected = "EGL: the packages libegl1 and libopengl0, or MUJOCO_GL=osmesa and libosmesa6"
                raise SimulationError(f"nothing draws here: {error}", expected=expected) from error
            self._drawn = model, size
        return self._renderer
