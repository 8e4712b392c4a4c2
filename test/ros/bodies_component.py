"""A component that tells where its Robot has its centre of mass."""

from solfer.components import Component, Port


class Balance(Component):
    """Tells the centre of mass of the measured Robot as the output `center_of_mass`."""

    def __init__(self, robot, tags=None, name=""):
        super().__init__(robot, tags, name)
        self.outputs["center_of_mass"] = Port("position")

    def send(self):
        """See `Component.send`."""
        self.outputs["center_of_mass"].value[:] = self.model.center_of_mass
