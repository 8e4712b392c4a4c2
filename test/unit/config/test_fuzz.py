"""Whatever the files contain, the loader returns a configuration or raises an error of ours.

SOLFER_FUZZ=2000 makes that many mistakes in shipped configurations, and SOLFER_FUZZ_SEED=S draws others.
"""

import os
import random
import resource
import shutil
import signal
import time
from contextlib import contextmanager
from functools import partial

import pytest
import yaml
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from support.recording.sine import recorded
from support.unit.mutations import damaged, mutated, shipped

from solfer.config import Configuration, load, module_names, read
from solfer.config.loading.rt_layer import read_layer
from solfer.errors import SolferError
from solfer.middleware.memory import read_faults
from solfer.model.actuators import ActuatorsRecord
from solfer.model.collisions.distances import LinkDistances
from solfer.model.contacts import read_contacts
from solfer.plugins import Registry, check_file
from solfer.robot.description import shipped as names_of_robots
from solfer.simulation.bundle import load_bundle
from solfer.simulation.mock_hardware.encoders import Encoders
from solfer.simulation.mock_hardware.mock_hardware import mounted
from solfer.simulation.mock_hardware.records import HardwareRecord
from solfer.simulation.world.world import read_world, steps_of
from solfer_tools.cli.main import main as solfer

WORDS = st.sampled_from(
    ["", "~", "{}", "[]", "[all]", "[[1]]", "{a: 1}", "-1", "1e400", ".nan", "0x" + "f" * 2000, "9" * 5000, "yes",
     "true", "''", "*x", "&x 1", "!!int 3", "!t 1", "'", "|", "\t", "\x00", "ä", "\U0001f600", '"\\ud800"', "../..",
     "package://", "package:///x", "$(find )", "{file: }", "{file: [1]}", "{path: 1, file: a}", "main.yaml",
     "{<<: {a: 1}}", "? x", "- - -", "x: y: z", "# nothing", "{list: [all]}", "all", "body", "SKIP", "\\x00"]
)  # fmt: skip
FILES = st.sampled_from(["main", "layer", "system", "secondary"])


@pytest.fixture(scope="module")
def folder(repository, tmp_path_factory):
    """Copy the configuration of the tests."""
    folder = tmp_path_factory.mktemp("fuzz")
    shutil.copytree(repository / "test/data/config", folder, dirs_exist_ok=True)
    return folder


def answers(folder, module: str = "mover") -> None:
    """Load and use; only errors of ours may come out."""
    main = folder / "main.yaml"
    assert all(str(error) for error in check_file(main).errors)
    try:
        module_names(main)
        configuration = load(main, module)
        assert isinstance(configuration, Configuration)
        assert configuration.rate > 0.0
        assert configuration.where("ros", "source")
        again = yaml.safe_load(configuration.text())["mwoibn"]
        assert list(again["modules"]) == [module]
    except SolferError as error:
        assert str(error)


@pytest.mark.slow
@settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(content=st.binary(max_size=200) | st.text(max_size=100).map(lambda text: text.encode("utf-8", "replace")))
@example(content=b"\xff\xfem\x00w\x00")
@example(content=b"[" * 5000)
@example(content=b"mwoibn: &a {modules: *a}")
@example(content=b"mwoibn: {modules: {mover: &a {<<: *a}}}")
def test_any_bytes(folder, content):
    (folder / "main.yaml").write_bytes(content)
    answers(folder)


@pytest.mark.slow
@settings(max_examples=250, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data(), name=FILES, word=WORDS, lines=st.booleans())
def test_any_value_anywhere(folder, repository, data, name, word, lines):
    """Replace one value, or one line, of one file."""
    for file in ("main", "layer", "system", "secondary"):
        shutil.copy(repository / f"test/data/config/{file}.yaml", folder / f"{file}.yaml")
    file = folder / f"{name}.yaml"
    separator = "\n" if lines else ": "
    parts = file.read_text().split(separator)
    place = data.draw(st.integers(0, len(parts) - 1))
    parts[place] = word
    file.write_bytes(separator.join(parts).encode("utf-8", "surrogatepass"))
    answers(folder)


CASES = int(os.environ.get("SOLFER_FUZZ", 8))
SEED = int(os.environ.get("SOLFER_FUZZ_SEED", 1))
LONGEST = 5.0
"""Processor time that a check may need [s]."""

MEMORY = 2 << 30
"""Memory that it may need in addition [B]."""


def robot(folder):
    """Read a robot's files as the simulator does before it begins."""
    place = folder / "robots/centauro"
    read_contacts(place / "contacts.yaml", "centauro")
    read(place / "actuators.yaml", ActuatorsRecord, ("centauro",))
    load_bundle(place / "robot.yaml")


def hardware(folder):
    """Read its files as the mock of the hardware does before it begins."""
    record = read(folder / "robots/centauro/hardware/mock.yaml", HardwareRecord)
    bundle = load_bundle(mounted(record))
    Encoders(record.joints, bundle.kinematics.dofs[6:], record.where("joints"))


def uses(folder, file):
    """Return the readers of a file: each ends with an exit code or an error of ours."""
    main, name = folder / "centauro.yaml", file.relative_to(folder).as_posix()
    if name.startswith("worlds/"):
        return [lambda: [steps_of(stairs) for stairs in read_world(file).stairs.values()]]
    if name.startswith("transport/"):
        return [lambda: read_faults(file)]
    if name.startswith("xbot"):
        return [lambda: read_layer(file, Registry().configuration).load()]
    check = [lambda: solfer(["check", str(main), "--json"]), lambda: solfer(["check", str(main), "--system", "HW"])]
    if not name.startswith("robots/"):
        return [*check, lambda: read_layer(folder / "xbot.yaml", Registry().configuration).load()]
    return [*check[:1], lambda: robot(folder), lambda: hardware(folder)]


@contextmanager
def limited():
    """Check the limits of time and memory."""

    def late(*_):
        raise AssertionError(f"needs longer than {LONGEST:g} s")

    before, limits = signal.signal(signal.SIGVTALRM, late), resource.getrlimit(resource.RLIMIT_AS)
    with open("/proc/self/statm") as file:
        size = int(file.read().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (size + MEMORY, limits[1]))
    signal.setitimer(signal.ITIMER_VIRTUAL, LONGEST)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
        signal.signal(signal.SIGVTALRM, before)
        resource.setrlimit(resource.RLIMIT_AS, limits)


def outcome(use, codes=(0, 2)):
    """Return the exit code, one of `codes`: 0 is accepted, 2 refused with a text."""
    try:
        code = use()
    except SolferError as error:
        assert str(error) and error.exit_code == 2
        return 2
    assert not isinstance(code, int) or code in codes
    return code if isinstance(code, int) else 0


def mistakes(files, uses, folder, capfd, codes=(0, 2)):
    """Make drawn mistakes in files, and let each of their uses accept it, or refuse it with an error of ours."""
    counts, failures, begin = dict.fromkeys(codes, 0), [], time.process_time()
    for case in range(CASES):
        draw = random.Random(f"{SEED}:{case}")
        file = draw.choice(files)
        good = file.read_bytes()
        if file.suffix == ".mcap":
            file.write_bytes(damaged(good, draw, resealed=draw.random() < 0.5))
        else:
            file.write_bytes(mutated(good.decode(), draw, file.suffix == ".yaml").encode("utf-8", "surrogatepass"))
        names_of_robots._names.cache_clear()
        for number, use in enumerate(uses(file)):
            try:
                with limited():
                    counts[outcome(use, codes)] += 1
            except BaseException as error:  # all of them are reported at the end
                failures.append(f"case {case}, use {number}, {file.name}: {type(error).__name__}: {str(error)[:200]}")
                keep = os.environ.get("SOLFER_FUZZ_KEEP")
                if keep:
                    shutil.copytree(folder, f"{keep}/{case}_{number}", dirs_exist_ok=True)
        file.write_bytes(good)
    out, error = capfd.readouterr()
    assert "Traceback" not in out + error
    with capfd.disabled():
        print(
            f" seed {SEED}: {CASES} mistakes, ended with {counts}, {len(failures)} failures, "
            f"{time.process_time() - begin:.0f} s"
        )
    assert not failures, "\n".join([f"SOLFER_FUZZ={CASES} SOLFER_FUZZ_SEED={SEED}", *failures])
    assert counts[0] > 0 and counts[2] > 0


@pytest.mark.slow
def test_any_mistake_in_a_shipped_configuration(repository, tmp_path, capfd):
    mistakes(shipped(repository, tmp_path), lambda file: uses(tmp_path, file), tmp_path, capfd)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["urdf", "srdf"])
def test_any_mistake_in_a_description_of_a_robot(repository, tmp_path, capfd, kind):
    """All readers of URDF and SRDF answer any mutated file with an error of solfer, or accept it."""
    files = [file for file in shipped(repository, tmp_path) if file.name == f"centauro.{kind}"]
    robot_of_files = [f"--{each}={tmp_path}/robots/centauro/centauro.{each}" for each in ("urdf", "srdf")]
    place = tmp_path / "robots/centauro"

    def shaped():
        kinematics = load_bundle(place / "robot.yaml").kinematics
        links = [name for name, link in kinematics.description.links.items() if link.collisions]
        LinkDistances(kinematics, [(links[0], links[-1])], influence=0.1)

    readers = [
        lambda: solfer(["list", "joints", *robot_of_files]),
        lambda: solfer(["list", "groups", *robot_of_files]),
        lambda: solfer(["cut", str(place / "centauro.urdf"), "--at", "pelvis", "--keep", "upper"]),
        lambda: robot(tmp_path),
        shaped,
    ]
    mistakes(files, lambda _: readers, tmp_path, capfd)


@pytest.mark.slow
def test_any_mistake_in_a_scenario(repository, tmp_path, capfd):
    shutil.copytree(repository / "config/scenarios", tmp_path, dirs_exist_ok=True)
    files = sorted(tmp_path.glob("*.yaml"))
    mistakes(files, lambda file: [lambda: solfer(["scenario", str(file)])], tmp_path, capfd)


@pytest.mark.slow
def test_any_damage_of_a_recording(tmp_path, capfd):
    """Every command that reads a recording takes a damaged one for a recording with differences at most."""
    file = recorded(tmp_path)
    name, good = str(file), str(shutil.copy(file, tmp_path / "good"))
    out = tmp_path / "out"
    commands = [
        ["log", "info", name],
        ["log", "cut", name, "-o", f"{out}.mcap", "--from", "0.1"],
        ["log", "export", name, "--csv", str(out)],
        ["log", "export", name, "--npz", f"{out}.npz"],
        ["log", "export", name, "--bag", f"{out}.bag"],
        ["compare", good, name],
        ["plot", name, "-o", f"{out}.png"],
        ["replay", name, "-n", "first"],
    ]
    mistakes([file], lambda _: [partial(solfer, command) for command in commands], tmp_path, capfd, (0, 1, 2))


@pytest.mark.daily(2)
@pytest.mark.slow
@pytest.mark.parametrize("name", ["x" * 5000, '"a\\0b"', "../../..", "/", "'*'"])
def test_impossible_robot_names_are_refused(repository, tmp_path, name):
    shipped(repository, tmp_path)
    main = tmp_path / "centauro.yaml"
    main.write_text(main.read_text().replace("name: centauro", f"name: {name}", 1))
    assert outcome(lambda: solfer(["check", str(main)])) in (0, 2)
