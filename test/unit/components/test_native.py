"""Components in libraries: what they declare and request, what fails, and that they compute what Python does."""

import platform
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError
from support.native import FLAGS, LISTINGS, SOURCES, JointSpaceTwin, TaskTrackingTwin, build

from solfer.components import Component
from solfer.components.native import records
from solfer.components.native.library import library_folders
from solfer.components.native.messages import NumbersOfFields
from solfer.components.native.tags import record_of
from solfer.errors import ComponentError, MiddlewareError, SolferError, UnknownName
from solfer.interfaces.declaration import TopicIn, TopicOut
from solfer.numerics.planar_move import PlanarMove
from solfer.plugins.generation.registry import load_class
from solfer.plugins.tuning import Tuning
from solfer.recording.log import Logger
from solfer.robot import Robot

pytestmark = pytest.mark.slow  # they compile

CENTAURO = Path(__file__).parents[3] / "config/robots/centauro"
WAYS = (0.02, 0.0, -0.05, 0.1, 0.0, 0.0, 0.0, 0.0, 0.1)


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    return build(tmp_path_factory.mktemp("native") / "libcomponents.so")


@pytest.fixture(scope="module")
def listings(tmp_path_factory):
    return build(tmp_path_factory.mktemp("native") / "liblistings.so", source=LISTINGS)


def centauro():
    robot = Robot.load(*(CENTAURO / f"centauro.{kind}" for kind in ("urdf", "srdf")))
    robot.state.position[6:] = 0.3
    return robot


def started(target, tags=None, robot=None):
    made = load_class(str(target))
    component = made(robot or centauro(), made.Tags(**tags or {}), "tested")
    component.set_rate(200.0)
    component.model.update()
    component.init()
    return component


def cycle(component):
    robot = component.model
    robot.update()
    if component.dynamics:
        robot.dynamics.update()
    component.update()
    component.send()
    return robot.command


@pytest.mark.parametrize("releases_gil", (False, True))
def test_joint_space_control_equals_its_twin_to_the_last_digits(library, releases_gil):
    native = started(f"{library}::JointSpace", {"releases_gil": releases_gil})
    twin = JointSpaceTwin(centauro(), JointSpaceTwin.Tags())
    twin.model.update()
    twin.init()
    random = np.random.default_rng(70)
    for _ in range(50):
        for component in (native, twin):
            component.model.state.position[:] = 0.3 + 0.0 * component.model.state.position
        for values in ("position", "velocity"):
            drawn = random.normal(0.0, 0.5, native.model.size)
            native.model.state[values][:] = twin.model.state[values][:] = drawn
        assert np.abs(cycle(native).torque - cycle(twin).torque).max() < 1e-12
    assert native.dynamics and np.abs(native.model.command.torque).max() > 10.0
    native.reset()
    native.init()  # its views are those of before
    assert np.array_equal(native.model.command.position, native.model.state.position)


def test_listing_3_equals_its_twin_and_arrives(listings):
    tags = {"way": WAYS, "hands": "manipulation", "torso": "torso_2"}
    native = started(f"{listings}::TaskTracking", tags)
    twin = TaskTrackingTwin(centauro(), TaskTrackingTwin.Tags(**tags))
    twin.set_rate(200.0)
    twin.model.update()
    twin.init()
    for _ in range(400):
        assert np.abs(cycle(native).position - cycle(twin).position).max() < 1e-12
        for component in (native, twin):
            component.model.state.position[:] = twin.model.command.position
    assert np.abs(twin.tasks.value - twin.references).max() < 1e-4


def test_the_other_listings_run(listings):
    hand = started(f"{listings}::PointTracking", {"link": "arm1_7", "way": (0.0, 0.1, 0.1)})
    robot = hand.model
    begin = robot.kinematics.position("arm1_7").copy()
    for _ in range(400):
        robot.state.position[:] = cycle(hand).position
    assert robot.kinematics.position("arm1_7") - begin == pytest.approx((0.0, 0.1, 0.1), abs=1e-3)
    links = {"left": "arm1_7", "right": "arm2_7", "base": "pelvis"}
    distances = started(f"{listings}::Distances", links)
    cycle(distances)
    kinematics = distances.model.kinematics
    off = kinematics.position("arm2_7") + kinematics.rotation("arm2_7") @ (0.0, 0.0, -0.15)
    point = distances.topics()[0].collect().point
    assert point.y == pytest.approx(np.linalg.norm(off - kinematics.position("pelvis")), abs=1e-12)
    driving = started(f"{listings}::JointSpaceDriving", {"turns": (1.0, -1.0, 1.0, -1.0)})
    (topic,) = driving.topics()
    twist = topic.message(linear=NumbersOfFields("twist", ("x",)).made((0.156,)))
    topic.handler(twist)
    wheels = driving.model.selectors["wheels"].indices
    assert cycle(driving).velocity[wheels] == pytest.approx((2.0, -2.0, 2.0, -2.0))
    driving.stop()
    assert not driving.model.command.velocity[wheels].any()


def test_what_it_declares_is_declared_as_in_python(library):
    component = started(f"{library}::JointSpace", {"joints": "arms"})
    joints = component.model.selectors["arms"].indices
    (received,) = (each for each in component.topics() if isinstance(each, TopicIn))
    (published,) = (each for each in component.topics() if isinstance(each, TopicOut))
    (service,) = component.services()
    before = cycle(component).torque.copy()
    received.handler(received.message(data=(0.1, 0.2)))
    change = cycle(component).torque - before
    assert change[joints[:2]] == pytest.approx((10.0, 20.0)) and not change[joints[2:]].any()
    assert published.collect().point == pytest.approx(published.collect().point) and service.reply().success
    with pytest.raises(ComponentError, match="nothing to do without `data`"):
        service.handler(service.request(data=False))
    assert service.handler(service.request(data=True)).success
    assert np.array_equal(cycle(component).torque, before)
    with pytest.raises(MiddlewareError, match="field 'data' of offset"):
        received.handler(received.message(data=(0.1,)))
    logger = Logger("tested/log")
    component.start_log(logger)
    assert np.array_equal(logger.sources[0].array[joints], component.model.command.torque[joints])


def test_live_numbers_move_in_place(library):
    component = started(f"{library}::JointSpace")
    tuning = Tuning(component, component.live_parameters())
    assert tuning.names == ("stiffness", "damping")
    component.model.state.position[6:] += 0.1
    first = cycle(component).torque.copy()
    component.live_parameters()[0].write(200.0)
    assert cycle(component).torque[6:] - first[6:] == pytest.approx(-10.0)


def test_a_place_of_the_world_moves_with_it(library):
    component = started(f"{library}::Remembering")
    move = PlanarMove((0.5, 0.0, 0.1), (2.0, 3.0, 0.4), 0.7)
    place = np.array((1.0, 2.0, 3.0))
    move.move(place)
    component.move_world(move)
    assert component.model.command.position[:3] == pytest.approx(place, abs=1e-15)
    assert load_class(f"{library}::Empty").move_world is Component.move_world


@pytest.mark.parametrize(
    ("how", "error", "words"),
    (
        ("dof", UnknownName, "unknown DoF 'no_such_joint'"),
        ("interface", UnknownName, "unknown interface 'no_such_interface'"),
        ("point", UnknownName, "unknown link 'no_such_link'"),
        ("tag", ComponentError, "reads a tag 'no_such_tag'"),
        ("path", ComponentError, r"'data\[' of out is no path"),
        ("throw", ComponentError, "the valve is stuck"),
        ("strange", ComponentError, "none of std::exception"),
    ),
)
def test_a_constructor_that_fails_is_one_error(library, how, error, words):
    with pytest.raises(error, match=words):
        started(f"{library}::Failing", {"how": how, "when": "constructor"})


def test_a_cycle_that_throws_is_a_fault_with_its_text(library):
    component = started(f"{library}::Failing", {"how": "throw"})
    with pytest.raises(ComponentError, match="Failing::update of libcomponents.so failed: the valve is stuck"):
        cycle(component)
    component.close()
    component.close()


def _other_machine(folder, library):
    code = bytearray(library.read_bytes())
    code[18] = 0x3E if platform.machine() == "aarch64" else 0xB7  # e_machine
    (folder / "libother.so").write_bytes(code)


def _without_symbol(folder, _library):
    (folder / "empty.c").write_text("int nothing;\n")
    subprocess.run(["gcc", "-shared", "-o", folder / "libother.so", folder / "empty.c"], check=True)


def _source(folder, tags='tags.number("gain", "gain");'):
    source = folder / "own.cpp"
    source.write_text(f"""
#include "solfer/component.hpp"
#ifdef OTHER
#undef SOLFER_INTERFACE
#define SOLFER_INTERFACE OTHER
#endif
struct Own : solfer::Component {{
  static void declare(solfer::Tags &tags) {{ {tags} }}
  explicit Own(solfer::Setup &) {{}}
}};
SOLFER_LIBRARY(SOLFER_COMPONENT(Own))
""")
    return source


@pytest.mark.parametrize(
    ("make", "words"),
    (
        (lambda folder, _: (folder / "libother.so").write_text("no library"), "cannot be loaded"),
        (_other_machine, "cannot be loaded.*\n.*shared library for"),
        (_without_symbol, "no symbol 'solfer_library'"),
        (lambda folder, _: build(folder / "libother.so", "-DOTHER=9", source=_source(folder)), "version 9 of"),
        (lambda folder, _: build(folder / "libother.so", source=_source(folder, "tags.live();")), "declare its tags"),
    ),
    ids=("no library", "other machine", "no symbol", "other version", "bad tags"),
)
def test_a_library_that_is_none_is_one_error(library, tmp_path, make, words):
    make(tmp_path, library)
    with pytest.raises(ComponentError, match=words) as caught:
        load_class(f"{tmp_path / 'libother.so'}::Own", "here.yaml:3:1")
    assert str(caught.value).startswith("here.yaml:3:1") and caught.value.expected


@pytest.mark.parametrize("name", ("gain", "_gain", "2x", "model_fields"))
def test_a_tag_that_cannot_be_one_is_one_error(name):
    tags = [records.Tag(each.encode(), b"", kind=records.NUMBER) for each in ("gain", name)]
    with pytest.raises(ComponentError, match=f"'Own' declares a tag '{name}'"):
        record_of("Own", tags)


def test_libraries_with_classes_of_one_name_stay_apart(tmp_path):
    made = []
    for name in ("first", "second"):
        target = build(tmp_path / f"lib{name}.so", source=_source(tmp_path, f'tags.text("{name}", "");'))
        made.append(load_class(f"{target}::Own"))
    assert [set(each.Tags.model_fields) - {"releases_gil"} for each in made] == [{"first"}, {"second"}]


def test_bounds_are_those_of_each_number(tmp_path):
    tags = 'tags.numbers("way", "way [m]").at_least(-1.0).at_most(2.0); tags.integer("count", 3, "").at_most(5);'
    made = load_class(f"{build(tmp_path / 'libown.so', source=_source(tmp_path, tags))}::Own")
    assert made.Tags(way=(-1.0, 2.0)).count == 3
    for wrong in ({"way": (0.0, 2.1)}, {"way": (-1.1,)}, {"way": (), "count": 6}, {"way": (), "count": 2.5}):
        with pytest.raises(ValidationError):
            made.Tags(**wrong)


def test_names_find_their_nearest(library, monkeypatch):
    with pytest.raises(UnknownName, match="did you mean: JointSpace"):
        load_class(f"{library}::JointSpac")
    monkeypatch.setenv("LD_LIBRARY_PATH", str(library.parent))
    assert library.parent in library_folders()
    assert load_class("libcomponents.so::Empty") is load_class(f"{library}::Empty")
    with pytest.raises(UnknownName, match="did you mean: libcomponents.so"):
        load_class("libcomponent.so::Empty")


def test_a_library_that_is_built_again_leaves_what_runs(library, tmp_path):
    place = tmp_path / "libcomponents.so"
    shutil.copy(library, place)
    component = started(f"{place}::JointSpace")
    before = cycle(component).torque.copy()
    place.unlink()  # as linkers do
    build(place, "-DNDEBUG", "-O0")
    assert np.array_equal(cycle(component).torque, before)
    with pytest.raises(ComponentError, match="built again since this process loaded it"):
        load_class(f"{place}::JointSpace")


@pytest.mark.parametrize("paths", (("a", "a"), ("a", "a.b"), ("a[2",), ("",)))
def test_paths_that_no_message_has_are_refused(paths):
    with pytest.raises(SolferError):
        NumbersOfFields("message", paths)


def test_numbers_become_fields_and_back():
    fields = NumbersOfFields("message", ("a.b.x", "a.b.n:int", "data[3]", "on:bool"))
    message = fields.made((1.5, 2.0, 3.0, 4.0, 5.0, 1.0))
    assert (message.a.b.x, message.a.b.n, message.data, message.on) == (1.5, 2, (3.0, 4.0, 5.0), True)
    assert fields.numbers(message) == [1.5, 2.0, 3.0, 4.0, 5.0, 1.0]


def test_without_python_it_runs_clean_and_allocates_nothing(tmp_path):
    program = tmp_path / "standalone"
    checks = ("-g", "-O0", "-fsanitize=address,undefined", "-fno-sanitize-recover=all")
    sources = (SOURCES / "standalone.cpp", SOURCES / "components.cpp")
    subprocess.run(["g++", *FLAGS, *checks, *sources, "-o", program], check=True)
    done = subprocess.run([program], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
