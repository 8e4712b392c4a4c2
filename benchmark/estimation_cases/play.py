"""Lets all methods estimate from the same measurements of a log."""

import math
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from estimation_cases.figures import figures, from_start
from estimation_cases.log import Log
from estimation_cases.measurements import Measurements, Sample
from estimation_cases.methods import OWN, Plugins
from estimation_cases.point_contacts import PointContacts
from estimation_cases.rolling_squares import RollingSquares

BEGIN = 10.0
"""Time at which estimators begin [s]: the IMU has settled."""
EVERY = 10
"""Cycles from one look at the covariances to the next."""

BASELINES: dict[str, Any] = {"rolling_squares": RollingSquares, "point_contacts": PointContacts}
METHODS = (*OWN, *BASELINES)


class Played:
    """What methods told of a log, cycle by cycle.

    Args:
        log: The log.
        seed: Seed of the errors of the sensors.
        noise: Their factor.
        names: Methods; `filter` is the first.

    Attributes:
        truth: Poses x y z heading, shape (T, 4) [m, rad].
        told: The same by each method.
        figures: Figures of each method.
    """

    def __init__(self, log: Log, seed: int, noise: float, names: tuple[str, ...]):
        self._own = tuple(name for name in names if name in OWN)
        self._others = {}
        self.truth, honesty, force = [], [], []
        self.told: dict[str, Any] = {name: [] for name in names}
        costs: dict[str, list[float]] = {name: [] for name in names}
        plugins: Plugins | None = None
        measurements = Measurements(log, seed, noise)
        with tempfile.TemporaryDirectory() as folder:
            for cycle, sample in enumerate(measurements):
                if sample.time < BEGIN:
                    continue
                if plugins is None:
                    plugins = Plugins(Path(folder), self._own, measurements.radii, noise, sample)
                    self._others = {
                        name: BASELINES[name](plugins.contacts, sample) for name in names if name in BASELINES
                    }
                plugins.cycle(sample)
                for name, method in self._others.items():
                    begun = time.thread_time()
                    method.cycle(sample, plugins.forces)
                    costs[name].append(time.thread_time() - begun)
                self._keep(sample, plugins)
                if cycle % EVERY == 0:
                    honesty.append(plugins.honesty(sample))
                    force.append((sample.force[:, 2], plugins.forces, plugins.touching))
        assert plugins is not None
        costs |= plugins.costs
        self.truth = np.array(self.truth)
        self.told = {name: np.array(poses) for name, poses in self.told.items()}
        self.figures = {name: figures(self.truth, poses) for name, poses in self.told.items()}
        for name, line in self.figures.items():
            line["cycle_p50"] = 1e6 * float(np.median(costs[name]))
        self._honest(self.figures["filter"], plugins.covariance(), honesty)
        true, estimated, touching = (np.array(column) for column in zip(*force, strict=True))
        for line in self.figures.values():
            line["force_error"] = math.sqrt(np.mean((estimated - true) ** 2)) / plugins.weight
            line["contact_right"] = float(np.mean((true > 5.0) == touching))

    def _keep(self, sample: Sample, plugins: Plugins) -> None:
        rotation = sample.truth.rotation
        self.truth.append(np.append(sample.truth.position, math.atan2(rotation[1, 0], rotation[0, 0])))
        for name, told in self.told.items():
            told.append(plugins.pose(name) if name in self._own else self._others[name].pose)

    def _honest(self, line: dict[str, float], covariance: np.ndarray, honesty: list[tuple[float, float]]) -> None:
        """Add how honest the filter's covariance is."""
        error = (from_start(self.told["filter"]) - from_start(self.truth))[-1, [0, 1, 3]]
        heading = float(self.told["filter"][0, 3])
        cosine, sine = math.cos(heading), math.sin(heading)
        turn = np.array(((cosine, sine, 0.0), (-sine, cosine, 0.0), (0.0, 0.0, 1.0)))
        known = turn @ covariance[np.ix_((0, 1, 3), (0, 1, 3))] @ turn.T
        line["anees"] = float(error @ np.linalg.solve(known, error)) / 3.0
        line["anees_tilt"], line["anees_velocity"] = np.mean(honesty, axis=0).tolist()
        line["position_deviation"] = math.sqrt(known[0, 0] + known[1, 1])
        line["heading_deviation"] = math.degrees(math.sqrt(known[2, 2]))
