#!/usr/bin/env python3
"""Compare torques and times of inverse dynamics with those of TSID, on ANYmal at random states.

Run with `./run exec python benchmark/tsid_peer.py --python INTERPRETER [--json] [--seed N] [--states N]`. INTERPRETER
is a Python of a virtual environment of its own where TSID is installed. Its wheel does not fit `pin` 4.1.0, so that it
is compiled, with Debian's `liburdfdom-dev` (10 minutes):

    pip install pin==4.1.0 jrl-cmakemodules
    prefix=$(python -c 'import cmeel, pathlib; print(pathlib.Path(cmeel.__file__).parents[1] / "cmeel.prefix")')
    CMAKE_PREFIX_PATH=$prefix pip install --no-binary tsid tsid==1.10.0

Both solve the same problem: centre of mass, orientation of the base and posture, with four feet that hold, friction and
limits of torques. The exit code is 1 if a torque differs by more than 0.01 Nm. Robots come with
`requirements-examples.txt`.
"""

import argparse
import subprocess
import sys
import tempfile
import time
from contextlib import closing, redirect_stdout
from importlib.metadata import distribution
from pathlib import Path

import numpy as np
import pinocchio
from form import Figures, parser_of

FEET = ("LF_FOOT", "RF_FOOT", "LH_FOOT", "RH_FOOT")
GOAL = 1e-2
"""Largest difference of torques [Nm]: each solver adds a small weight of its own to accelerations and forces."""


def solved_here(states: int, seed: int, folder: Path) -> dict[str, np.ndarray]:
    """Solve the problem of the component at random states, and return it with its torques and times."""
    from inverse_dynamics import started
    from support.integration.torque_robot import LEGGED, ROBOTS

    with redirect_stdout(sys.stderr):
        robot, component = started("anymal", 1e-9, None, folder)
    with closing(robot):
        robot.run(1.0)
        model = component.model
        home, random = model.state.position.copy(), np.random.default_rng(seed)
        chart, data = model.kinematics.pinocchio[0], model.kinematics.pinocchio[0].createData()
        base = chart.getFrameId("base")
        component.start_position = home
        component.init()
        kept: dict[str, list[np.ndarray]] = {}
        for _ in range(states):
            model.state.position[:] = home
            model.state.position[6:] += random.uniform(-0.05, 0.05, model.size - 6)
            model.state.velocity[:] = random.normal(0.0, 0.1, model.size)
            start = time.thread_time()
            model.update()
            model.dynamics.update()
            component.update()
            passed = time.thread_time() - start
            position, velocity = model.state.position.copy(), model.state.velocity.copy()
            pinocchio.forwardKinematics(chart, data, position, velocity)
            placement = pinocchio.updateFramePlacement(chart, data, base)
            twist = pinocchio.getFrameVelocity(chart, data, base, pinocchio.LOCAL)
            row = {
                "placement": pinocchio.SE3ToXYZQUAT(placement),
                "twist": twist.vector,
                "position": position[6:],
                "velocity": velocity[6:],
                "com": component.tasks["com"].reference.value.copy(),
                "posture": component.tasks["posture"].reference.value.copy(),
                "torque": component.problem.torque[6:].copy(),
                "active": np.array(component.problem.active.sum()),
                "time": np.array(passed),
                "names": np.array(model.dofs[6:]),
            }
            for key, value in row.items():
                kept.setdefault(key, []).append(value)
        result = {key: np.array(values) for key, values in kept.items()}
        limits = component.model.upper_limits.torque[6:]
        urdf = distribution("example-robot-data").locate_file(ROBOTS + LEGGED["anymal"].urdf)
        result |= {"urdf": np.array(str(urdf)), "limits": limits, "unit": np.array(component.ground.unit)}
        return result


def solved_by_tsid(folder: Path) -> None:
    """Solve the problems of `problems.npz` by TSID, and write torques and times to `tsid.npz`."""
    import tsid

    problems = np.load(folder / "problems.npz")
    robot = tsid.RobotWrapper(str(problems["urdf"]), [], pinocchio.JointModelFreeFlyer(), False)
    model = robot.model()
    order = [model.joints[model.getJointId(str(name))].idx_v - 6 for name in problems["names"][0]]
    formulation = tsid.InverseDynamicsFormulationAccForce("formulation", robot, False)
    position, velocity = np.concatenate((problems["placement"][0], np.zeros(robot.na))), np.zeros(robot.nv)
    formulation.computeProblemData(0.0, position, velocity)
    friction = np.sqrt(0.5) * 0.7
    contacts = []  # TSID does not keep them
    for foot in FEET:
        contact = tsid.ContactPoint(f"contact_{foot}", robot, foot, np.array((0.0, 0.0, 1.0)), friction, 0.0, 1e4)
        contact.useLocalFrame(False)
        contact.setKp(np.zeros(3))
        contact.setKd(np.full(3, 10.0))
        contact.setRegularizationTaskWeightVector(np.ones(3))
        contacts.append(contact)
        formulation.addRigidContact(contact, 1e-5 / float(problems["unit"]) ** 2, 1.0, 0)
    com = tsid.TaskComEquality("com", robot)
    com.setKp(np.full(3, 8.0 * 32.0))
    com.setKd(np.full(3, 32.0))
    formulation.addMotionTask(com, 1.0, 1, 0.0)
    base = tsid.TaskSE3Equality("base", robot, "base")
    base.setMask(np.array((0.0, 0.0, 0.0, 1.0, 1.0, 1.0)))
    base.setKp(np.full(6, 8.0 * 32.0))
    base.setKd(np.full(6, 32.0))
    formulation.addMotionTask(base, 1.0, 1, 0.0)
    posture = tsid.TaskJointPosture("posture", robot)
    posture.setKp(np.full(robot.na, 5.0 * 20.0))
    posture.setKd(np.full(robot.na, 20.0))
    formulation.addMotionTask(posture, 1e-5, 1, 0.0)
    bounds = tsid.TaskActuationBounds("bounds", robot)
    limits = np.zeros(robot.na)
    limits[order] = problems["limits"]
    bounds.setBounds(-limits, limits)
    formulation.addActuationTask(bounds, 1.0, 0, 0.0)
    solver = tsid.SolverHQuadProgFast("solver")
    solver.resize(formulation.nVar, formulation.nEq, formulation.nIn)
    torques, times = [], []
    for index in range(len(problems["position"])):
        joints, rates, aim = np.zeros((3, robot.na))
        joints[order], rates[order] = problems["position"][index], problems["velocity"][index]
        aim[order] = problems["posture"][index]
        position = np.concatenate((problems["placement"][index], joints))
        velocity = np.concatenate((problems["twist"][index], rates))
        for task, value in ((com, problems["com"][index]), (posture, aim)):
            sample = tsid.TrajectoryEuclidianConstant("reference", value).computeNext()
            task.setReference(sample)
        placement = pinocchio.XYZQUATToSE3(problems["placement"][index])
        base.setReference(tsid.TrajectorySE3Constant("reference", placement).computeNext())
        start = time.thread_time()
        problem = formulation.computeProblemData(0.0, position, velocity)
        solution = solver.solve(problem)
        torque = formulation.getActuatorForces(solution)
        times.append(time.thread_time() - start)
        torques.append(torque[order] if solution.status == 0 else np.full(robot.na, np.nan))
    np.savez(folder / "tsid.npz", torque=np.array(torques), time=np.array(times))


def compare(python: str, states: int, seed: int, figures: Figures) -> bool:
    """Print all figures; return whether torques agree."""
    with tempfile.TemporaryDirectory() as folder:
        here = solved_here(states, seed, Path(folder))
        np.savez(Path(folder) / "problems.npz", **here)
        subprocess.run([python, __file__, "--problems", folder], check=True, timeout=300)
        other = np.load(Path(folder) / "tsid.npz")
        solved = ~np.isnan(other["torque"][:, 0])
        difference = float(np.abs(other["torque"] - here["torque"])[solved].max())
        for title, value, unit in (
            ("states that TSID solves", 100.0 * float(solved.mean()), "%"),
            ("states with active constraints", 100.0 * float((here["active"] > 0).mean()), "%"),
            ("largest torque", float(np.abs(here["torque"]).max()), "Nm"),
            ("largest difference of torques", difference, "Nm"),
            ("cycle of solfer, median", 1e6 * float(np.median(here["time"])), "us"),
            ("cycle of TSID, median", 1e6 * float(np.median(other["time"])), "us"),
        ):
            figures.row(title, value=value, unit=unit)
        return bool(solved.all()) and difference <= GOAL


def main() -> int:
    """Print all figures."""
    parser = parser_of(__doc__)
    parser.add_argument("--python", default=sys.executable, help="an interpreter with TSID (default: this one)")
    parser.add_argument("--states", type=int, default=100, help="random states (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=1, help="of the states (default: %(default)s)")
    parser.add_argument("--problems", type=Path, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.problems is not None:
        solved_by_tsid(arguments.problems)
        return 0
    return 0 if compare(arguments.python, arguments.states, arguments.seed, Figures(arguments.json)) else 1


if __name__ == "__main__":
    sys.exit(main())
