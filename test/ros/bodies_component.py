"""A component that publishes where its Robot has its centre of mass and its wheels."""

from solfer.components import Component, Port

WHEELS = ("wheel_1", "wheel_2", "wheel_3", "wheel_4")


class BodyPoints(Component):
    """Publishes `center_of_mass` and `wheels`, the origins of their links, of the measured Robot."""

    def __init__(self, robot, tags=None, name=""):
        super().__init__(robot, tags, name)
        self.outputs["center_of_mass"] = Port("position")
        self.outputs["wheels"] = Port("position", len(WHEELS))

    def send(self):
        """See `Component.send`."""
        self.outputs["center_of_mass"].value[:] = self.model.kinematics.center_of_mass
        for wheel, position in zip(WHEELS, self.outputs["wheels"].value, strict=True):
            position[:] = self.model.kinematics.position(wheel)
