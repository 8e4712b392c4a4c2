"""A configuration of the original program loads unchanged, with warnings, with a search path for its files."""

from pathlib import Path

import pytest

from solfer.config import load
from solfer.errors import SolferError, UnknownName
from solfer.plugins import check_file
from solfer.robot import RobotFiles

MODULES = (
    "joint_states", "joint_lower", "joint_reference", "wheeled_motion", "upper_body_ik", "odometry",
    "gravity_compensation", "compliance_compensation", "ground_forces", "gravity_forces", "acceleration_test",
)  # fmt: skip


@pytest.fixture
def folder(repository):
    return repository / "test/data/original"


@pytest.fixture
def robot(repository, folder):
    """Return the shipped robot with the original's groups."""
    return RobotFiles(
        repository / "config/robots/centauro/centauro.urdf",
        folder / "centauro_full_wheels.srdf",
        contacts=folder / "support/contacts.yaml",
    )


@pytest.mark.slow
def test_every_module_loads(folder, robot):
    report = check_file(folder / "mwoibn_2_5.yaml", search_paths=[folder], robot=robot)
    assert report.errors == ()
    assert (report.modules, tuple(report.configurations)) == ((*MODULES, "shared"), MODULES)
    rates = {configuration.rate for configuration in report.configurations.values()}
    assert rates == {200.0}  # of support/NRT.yaml
    plugins = [(entry.plugin, entry.configuration.module.name) for entry in report.shared["shared"].plugins]
    assert plugins == [("odometry3", "odometry"), ("ground_forces", "ground_forces")]


@pytest.mark.slow
def test_names_are_checked_with_the_shipped_robot(folder):
    assert check_file(folder / "mwoibn_2_5.yaml", search_paths=[folder]).errors == ()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("line", "words"),
    [
        (292, "controller.position_controller.initialize: has no effect"),
        (389, "the pipe 'floating_base' has no 'source', so nothing can use it"),
        (477, "xbot.feedback.velocity_online: the key 'space' is missing, so nothing can use it"),
    ],
)
def test_obsolete_keys_give_warnings_with_their_lines(folder, line, words):
    report = check_file(folder / "mwoibn_2_5.yaml", search_paths=[folder])
    assert any(notice.mark.line == line and words in str(notice) for notice in report.warnings)


@pytest.mark.slow
def test_plugins_that_are_not_here_are_one_line(folder):
    file = folder / "mwoibn_2_5.yaml"
    assert not check_file(file, search_paths=[folder]).information
    (notice,) = check_file(file, ["wheeled_motion"], search_paths=[folder], plugin="NwheelsSecondOrder").information
    assert notice.what.startswith("the plugins of wheeled_motion are not available here")


@pytest.mark.slow
def test_tags_of_a_known_plugin_are_read(folder):
    report = check_file(folder / "mwoibn_2_5.yaml", search_paths=[folder])
    assert not any("joint_" in notice.what for notice in report.warnings)


@pytest.mark.slow
def test_each_missing_file_is_named_once(folder):
    report = check_file(folder / "mwoibn_2_5.yaml")
    assert [error.where.split(":")[1] for error in report.errors[:2]] == ["12", "15"]
    assert "there is no file '/opt/catkin_ws/src/DrivingFramework/configs/mwoibn/configs/support/RT.yaml'" in str(
        report.errors[0]
    )
    places = [error.where for error in report.errors]
    assert len(places) == len(set(places))


def test_files_are_found_by_the_longest_path_tail(folder, tmp_path):
    """support/upper_body.yaml exists twice below the folder; the one with more of the path counts."""
    deep = tmp_path / "configs/mwoibn/configs/support"
    deep.mkdir(parents=True)
    (deep / "upper_body.yaml").write_text((folder / "support/upper_body.yaml").read_text())
    (tmp_path / "upper_body.yaml").write_text("mwoibn: {middleware: wrong}")
    configuration = load(folder / "mwoibn_2_5.yaml", "upper_body_ik", search_paths=[tmp_path, folder])
    assert configuration.where("ros", "source", "urdf").startswith(f"{deep}/upper_body.yaml:9:")


@pytest.mark.slow
def test_grammar_errors_have_their_places(folder, tmp_path):
    text = (folder / "mwoibn_2_5.yaml").read_text()
    file = Path(tmp_path / "main.yaml")
    file.write_text(text.replace("chain: chains", "chain: chians").replace("type: reference", "type: refrence", 1))
    report = check_file(file, search_paths=[folder])
    assert [(error.where.split(":")[1], error.names[:1]) for error in report.errors] == [
        ("304", ("reference",)),
        ("543", ("chains",)),
    ]


def test_a_missing_plugin_cannot_start(folder):
    from solfer.plugins import Registry

    registry = Registry()
    with pytest.raises(SolferError, match="'NwheelsSecondOrder' is not available here"):
        registry.find("NwheelsSecondOrder")
    with pytest.raises(UnknownName):
        registry.find("odometri3")
