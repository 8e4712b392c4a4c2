"""Lets all methods estimate from the same measurements of a log."""

import math
import tempfile
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from estimation_cases.figures import figures, from_start, normalised
from estimation_cases.log import Log
from estimation_cases.measurements import Measurements, Sample
from estimation_cases.methods import OWN, Plugins
from estimation_cases.point_contacts import PointContacts
from estimation_cases.rolling_squares import RollingSquares
from estimation_cases.smoother import Smoother

from solfer.middleware.memory import FaultsRecord

BEGIN = 10.0
"""Time at which estimators begin [s]: the IMU has settled."""
EVERY = 10
"""Cycles from one look at the covariances to the next."""

NORMALISED = {
    "anees": [0, 1, 3],
    "anees_position": [0, 1],
    "anees_height": [2],
    "anees_heading": [3],
}
"""Figures of the squared error at the end by its covariance, and which of x, y, z and heading they are of."""

BASELINES: dict[str, Any] = {"rolling_squares": RollingSquares, "point_contacts": PointContacts, "smoother": Smoother}
METHODS = (*OWN, *BASELINES)


class Played:
    """What methods estimate of a log, cycle by cycle.

    Args:
        log: The log.
        seed: Seed of the errors of the sensors.
        noise: Their factor.
        names: Methods; `filter` is the first.
        faults: What goes wrong between the sensors and all methods; None: nothing.

    Attributes:
        truth: Poses x y z heading, shape (T, 4) [m, rad].
        estimates: The same by each method.
        figures: Figures of each method.
    """

    def __init__(self, log: Log, seed: int, noise: float, names: tuple[str, ...], faults: FaultsRecord | None = None):
        self._own = tuple(name for name in names if name in OWN)
        self._others: dict[str, Any] = {}
        self._noise = noise
        self.truth, honesty, force = [], [], []
        self.estimates: dict[str, Any] = {name: [] for name in names}
        measurements = Measurements(log, seed, noise)
        with tempfile.TemporaryDirectory() as folder:
            plugins = Plugins(Path(folder), self._own, measurements.radii, noise, faults)
            for cycle, sample in enumerate(measurements):
                if sample.time < BEGIN:
                    continue
                plugins.publish(sample)
                if not plugins.plugins and not self._begin(plugins, names):
                    continue
                plugins.cycle()
                if not (self.truth or plugins.running):
                    continue
                self._keep(sample, plugins)
                if cycle % EVERY == 0:
                    honesty.append(plugins.honesty(sample))
                    force.append((sample.force[:, 2], plugins.forces, plugins.touching))
        for method in self._others.values():
            if isinstance(method, Smoother):
                method.smooth()
        self.truth = np.array(self.truth)
        self.estimates = {name: np.array(poses) for name, poses in self.estimates.items()}
        self.figures = {name: figures(self.truth, poses) for name, poses in self.estimates.items()}
        for name, line in self.figures.items():
            line["cycle_p50"] = 1e6 * float(np.median(plugins.costs[name]))
        self._honest(self.figures["filter"], plugins.covariance(), honesty)
        true, estimated, touching = (np.array(column) for column in zip(*force, strict=True))
        for line in self.figures.values():
            line["force_error"] = math.sqrt(np.mean((estimated - true) ** 2)) / plugins.weight
            line["contact_right"] = float(np.mean((true > 5.0) == touching))

    def _begin(self, plugins: Plugins, names: tuple[str, ...]) -> bool:
        """Let all methods begin if both sensors have measured; return whether they do."""
        received = plugins.received
        if received is None:
            return False
        plugins.begin()
        for name in names:
            if name in BASELINES:
                make = partial(Smoother, noise=self._noise) if name == "smoother" else BASELINES[name]
                self._others[name] = method = make(plugins.contacts, received)
                plugins.loop(name, partial(_cycle, method, plugins))
        return True

    def _keep(self, sample: Sample, plugins: Plugins) -> None:
        rotation = sample.truth.rotation
        self.truth.append(np.append(sample.truth.position, math.atan2(rotation[1, 0], rotation[0, 0])))
        for name, estimates in self.estimates.items():
            estimates.append(plugins.pose(name) if name in self._own else self._others[name].pose)

    def _honest(self, line: dict[str, float], covariance: np.ndarray, honesty: list[tuple[float, float]]) -> None:
        """Add how honest the filter's covariance is."""
        error = (from_start(self.estimates["filter"]) - from_start(self.truth))[-1]
        heading = float(self.estimates["filter"][0, 3])
        cosine, sine = math.cos(heading), math.sin(heading)
        turn = np.eye(4)
        turn[:2, :2] = (cosine, sine), (-sine, cosine)
        known = turn @ covariance @ turn.T
        for key, which in NORMALISED.items():
            line[key] = normalised(error[which], known[np.ix_(which, which)])
        line["anees_tilt"], line["anees_velocity"] = np.mean(honesty, axis=0).tolist()
        line["position_deviation"] = math.sqrt(known[0, 0] + known[1, 1])
        line["heading_deviation"] = math.degrees(math.sqrt(known[3, 3]))


def _cycle(method: Any, plugins: Plugins) -> None:
    """Let a method from the literature work on what has arrived."""
    method.cycle(plugins.received, plugins.forces)
