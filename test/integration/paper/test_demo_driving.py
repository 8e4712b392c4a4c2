"""The demonstration of Fig. 5 on the virtual clock: it drives, and its table has what truly happened."""

import re
from contextlib import closing

import numpy as np
import pytest
from support.paper.full_control import Nodes, course

from solfer.middleware.memory import MemoryMiddleware
from solfer.recording.model import COLUMNS_KIND, Channel, Recording
from solfer.simulation.world.world import FLAT_WORLD
from solfer.transport.health import Health
from solfer.transport.middleware import HealthReport
from solfer_tools.demo import centauro, driving, driving_report
from solfer_tools.demo.driving_record import DrivingRecorder
from solfer_tools.demo.film import film

COURSE = course(0.3, 0.5, 0.15, 0.25)


@pytest.fixture
def world(tmp_path):
    with closing(Nodes(tmp_path)) as world:
        yield world


class Log:
    """Keeps what components log, as a recording has it."""

    def __init__(self, world, *plugins):
        self._arrays, self._columns, self._rows = {}, {}, []
        for self._plugin in plugins:
            world.plugins[self._plugin].component.start_log(self)
        world.bus.every(0.01, lambda: self._rows.append((world.bus.time, self._now())))

    def add(self, name, array, columns, *_):
        """Declare an array, which is live."""
        self._arrays[f"{self._plugin}/log/{name}"], self._columns[f"{self._plugin}/log/{name}"] = array, tuple(columns)

    def _now(self):
        return {name: np.ravel(array).copy() for name, array in self._arrays.items()}

    def recording(self):
        """Return the recording."""
        times = np.array([time for time, _ in self._rows])
        return Recording(
            {
                name: Channel(
                    name,
                    COLUMNS_KIND,
                    columns,
                    ("",) * len(columns),
                    "",
                    times,
                    np.array([row[name] for _, row in self._rows]),
                )
                for name, columns in self._columns.items()
            }
        )


@pytest.mark.soak
def test_the_demonstration_drives_and_tells_it(world, tmp_path):
    """Each row of its table agrees with the simulator's own state: way, heading, errors, slip, ground forces."""
    course, reports = tmp_path / "course.yaml", []
    course.write_text(COURSE)
    node, log = MemoryMiddleware(world.bus, "demo"), Log(world, "locomotion", "hands")
    recorder = DrivingRecorder(node)
    assert recorder.missing() == "the joint states of the robot, on joint_states"
    world.run(3.0)
    waited = driving.wait_for_robot(node, recorder, 0.0, lambda: None)
    shown = driving.Driving(node, recorder, waited.robot, waited.legs, course)
    assert shown.run(KeptProgress(reports)) == 0
    assert reports[-1][1] == reports[-1][2] > 2.0 and "waits for the topics of others" in {
        title for title, *_ in reports
    }
    seen = driving_report.see(shown.robot, shown.legs, recorder)
    places = driving_report.tracked(recorder, seen, log.recording())
    rows = dict(driving_report.table(shown.robot, recorder, seen, places, {}))
    x, turned = re.match(r"(.*) m, turned by (.*) degrees", rows["driven"]).groups()
    now = world.simulation.state.now
    assert float(x) == pytest.approx(np.hypot(*now.position("pelvis")[:2]), abs=0.02) and float(x) > 0.2
    assert 15 < float(turned) < 30
    for row, most in (("centre of mass of the legs, from its reference", 5.0), ("vertices", 6.0), ("hands", 8.0)):
        assert 0.0 < float(re.search(r"([\d.]+) mm at most", rows[row])[1]) < most
    assert float(rows["odometry against truth"].split()[0]) < 5.0
    assert float(rows["slip, fraction of the way of wheels"]) < 0.02
    assert 95.0 < float(rows["forces of the ground"].split()[1]) < 105.0
    path = tmp_path / "film.gif"
    film(shown.robot, seen.time[-30:], seen.position[-30:], FLAT_WORLD, path)
    assert path.read_bytes().startswith(b"GIF89a") and path.stat().st_size > 3000


class KeptProgress(centauro.Progress):
    """Keeps what is shown."""

    def __init__(self, reports):
        super().__init__()
        self._reports = reports

    def __call__(self, *shown):
        self._reports.append(shown)


def test_a_slow_machine_is_reported():
    seen = driving_report.Seen(np.array([0.0, 9.0]), *[np.zeros(0)] * 6)
    assert "4.0 s of simulated time" in driving_report.warning({"simulation": lost(4.0)}, seen, 10.0)
    assert not driving_report.warning({"simulation": lost(0.1)}, seen, 9.1)
    left_out = HealthReport(Health.GOOD, "running", {"skipped periods": 20, "cycles": 80})
    assert "odometry left out 20 %" in driving_report.warning({"odometry": left_out}, seen, 9.1)
    assert not driving_report.warning({"odometry": left_out}, seen, 9.1, waited=True)


@pytest.mark.parametrize(("is_lockstep", "figure"), [(False, "1.00 lately, 46.5 s lost"), (True, "1.00 lately")])
def test_a_simulation_that_waits_loses_no_time(is_lockstep, figure):
    report = HealthReport(Health.GOOD, "runs", {"real-time factor": 1.0, "time lost [s]": 46.5})
    assert driving_report._health({"simulation": report}, is_lockstep) == [("real-time factor", figure)]


def test_a_figure_that_is_too_large_is_marked():
    assert driving_report.bounded(0.5, 0.8, "degrees") == ""
    assert driving_report.bounded(0.9, 0.8, "degrees") == "  <-- more than 0.8 degrees"


def lost(seconds):
    """Return the health of a simulation that has lost a time [s]."""
    return HealthReport(Health.GOOD, "running", {"time lost [s]": seconds})
