"""What several tests of sharing share."""

from solfer.components import Component

MOTION, WATCHED = {"joints": ("torso_yaw", "j_arm1_4"), "positions": (0.4, -0.6)}, "arm1_7"


class StateWitness(Component):
    """Records the measured State, and where a link is."""

    def init(self):
        self.seen = []

    def update(self):
        state = self.model.state
        place = self.model.kinematics.position(WATCHED)
        self.seen.append((state.position.tobytes(), state.velocity.tobytes(), state.torque.tobytes(), place.tobytes()))
