"""Files of a study that others wrote, or damaged: one error or none, and nothing changes outside of its folder."""

import json
import random
import shutil
from contextlib import suppress

import numpy as np
import pytest
from support.unit.studies import made

from solfer.errors import SolferError, SolferErrors, StudyError
from solfer_tools.study import Result
from solfer_tools.study.drive import find_run
from solfer_tools.study.folder import COLUMNS_FILE, RECORDING, STUDY, StudyFolder
from solfer_tools.study.plan import MOST_RUNS
from solfer_tools.study.report import write_report

SCRIPT = "<script>alert(1)</script>"
ODD = (
    None, [], {}, "", 5, -1, 2**70, 1e300, float("nan"), float("-inf"), True, "../../escape", "/escape", "a\0b", "\n",
    SCRIPT, "x" * 5000, [[], [[]]], {"a": {"b": [1]}}, "claim.1", "$\\frac$", "1e5",
)  # fmt: skip
NAMES = ("claim.1~", "claim.01", "claim.x", "claim.", "claim.1.swp", "claim.-1", "claim.99999999999")


@pytest.fixture(scope="module")
def original(tmp_path_factory):
    """Make a study of which one run is done, one has failed, and one is claimed."""
    folder = tmp_path_factory.mktemp("original")
    vary = {"mass": {"path": "simulation/mass", "grid": [0.9, 1.0, 1.1]}}
    study = made(folder, vary=vary, fails={"tilts": "tilt > 1"})
    made_folder = StudyFolder.create(folder / "out", study, study.plan())
    done, failed, claimed = made_folder.runs
    for run, result in ((done, Result("", {"tilt": 0.1}, 0.2)), (failed, Result(f"tilts {SCRIPT}", {"tilt": 2.0}))):
        made_folder.claim(run)
        times = np.arange(5.0)
        columns = {"names": np.array(["a", "b"]), "times": times, "values": np.ones((2, 5), dtype=np.float32)}
        np.savez_compressed(made_folder.of(run) / COLUMNS_FILE, **columns)
        made_folder.finish(run, result)
    made_folder.claim(claimed)
    return folder / "out"


def places(tree, path=()):
    """Yield the path of each value of maps and lists."""
    entries = tree.items() if isinstance(tree, dict) else enumerate(tree) if isinstance(tree, list) else ()
    for key, value in entries:
        yield (*path, key)
        yield from places(value, (*path, key))


def damage(file, draw):
    """Replace a value of a JSON file by an odd one, drop or add one, or damage the bytes of any file."""
    content = file.read_bytes()
    try:
        tree = json.loads(content)
    except ValueError:
        tree = None
    kinds = ("bytes", "cut", "empty") if tree is None else ("value", "value", "value", "drop", "cut", "deep")
    kind = draw.choice(kinds)
    if kind in ("value", "drop"):
        *way, key = draw.choice(list(places(tree)))
        parent = tree
        for each in way:
            parent = parent[each]
        if kind == "value":
            parent[key] = draw.choice(ODD)
        else:
            del parent[key]
        file.write_text(json.dumps(tree))
    elif kind == "deep":
        file.write_text("[" * 100_000 + "]" * 100_000)
    elif kind == "bytes":
        damaged = bytearray(content)
        for _ in range(draw.randrange(1, 20)):
            damaged[draw.randrange(len(damaged))] = draw.randrange(256)
        file.write_bytes(damaged)
    else:
        file.write_bytes(content[: draw.randrange(len(content))] if kind == "cut" else b"")


def use(path, draws):
    """Do with a folder what commands and workers do, and draw its page or not; errors other than solfer's pass."""
    folder = StudyFolder(path)
    for run in folder.runs:
        if (claim := folder.claim(run)) is not None:
            claim.renew()
            folder.finish(run, Result("", {"tilt": 0.3}, 0.2))
        folder.attempts(run)
        find_run(folder, run.id)
    folder.write_table()
    if draws:
        write_report(folder)
        assert SCRIPT not in (path / "report.html").read_text()


def outside(path):
    """Return all files beside a folder, with their contents."""
    files = [each for each in path.parent.parent.rglob("*") if each.is_file() and path not in each.parents]
    return {each: each.read_bytes() for each in files}


@pytest.mark.daily(2)
@pytest.mark.parametrize("seed", range(30))
def test_a_strange_file_is_one_error_or_none(original, tmp_path, seed):
    draw = random.Random(seed)
    (tmp_path / "others").write_text("theirs")
    for number in range(10):
        path = tmp_path / f"in/{number}"
        shutil.copytree(original, path)
        before = outside(path)
        files = sorted(each for each in path.rglob("*") if each.is_file())
        damage(draw.choice(files), draw)
        if draw.random() < 0.3:
            (draw.choice(sorted(path.glob("runs/*"))) / draw.choice(NAMES)).write_text("theirs")
        with suppress(SolferError, SolferErrors):
            use(path, draw.random() < 0.3)
        assert outside(path) == before
        shutil.rmtree(path)


@pytest.mark.parametrize("name", ["../../escape", "/escape", "0123", "0123456789ABCDEF", "0123456789abcde\n", 5])
def test_the_id_of_a_run_is_no_path(original, tmp_path, name):
    path = tmp_path / "out"
    shutil.copytree(original, path)
    data = json.loads((path / STUDY).read_text())
    data["runs"][1]["id"] = name
    (path / STUDY).write_text(json.dumps(data))
    with pytest.raises(StudyError, match=r"runs\.1\.id: "):
        StudyFolder(path)


def test_files_of_others_beside_a_claim_count_as_none(original, tmp_path):
    path = tmp_path / "out"
    shutil.copytree(original, path)
    folder = StudyFolder(path)
    run = folder.runs[2]
    for name in NAMES:
        (folder.of(run) / name).write_text("[]")
    (folder.of(run) / "claim.1").write_text("[]")
    assert folder.attempts(run) == 1 and folder.claim(run) is None  # it lives until it is old


def test_a_run_whose_folder_is_a_link_is_refused(original, tmp_path):
    path = tmp_path / "out"
    shutil.copytree(original, path)
    folder = StudyFolder(path)
    run = folder.runs[2]
    shutil.rmtree(folder.of(run))
    (tmp_path / "elsewhere").mkdir()
    folder.of(run).symlink_to(tmp_path / "elsewhere")
    for action in (folder.claim, lambda each: folder.output(each, RECORDING)):
        with pytest.raises(StudyError, match="it is a link"):
            action(run)
    assert not list((tmp_path / "elsewhere").iterdir())


def test_a_file_of_a_run_that_is_a_link_is_replaced(original, tmp_path):
    path = tmp_path / "out"
    shutil.copytree(original, path)
    folder = StudyFolder(path)
    run = folder.runs[2]
    (tmp_path / "theirs").write_text("theirs")
    (folder.of(run) / RECORDING).symlink_to(tmp_path / "theirs")
    folder.output(run, RECORDING).write_text("ours")
    assert (tmp_path / "theirs").read_text() == "theirs" and not (folder.of(run) / RECORDING).is_symlink()


@pytest.mark.parametrize("name", ["run", "id", "seed", "failed", "failure", "tilt"])
def test_two_columns_of_the_table_have_different_names(tmp_path, name):
    with pytest.raises(SolferError, match=f"two columns of the table are named '{name}'"):
        made(tmp_path, vary={name: {"path": "simulation/mass", "grid": [1.0]}})
    if name != "tilt":
        with pytest.raises(SolferError, match=f"two columns of the table are named '{name}'"):
            made(tmp_path, measure={name: {"columns": "simulation/base/tilt"}})


def test_a_million_times_a_thousand_runs_are_too_many(tmp_path):
    study = made(tmp_path, vary={"mass": {"path": "simulation/mass", "grid": [1.0] * 1000}}, runs=1_000_000)
    with pytest.raises(SolferError, match=f"1000000000 runs\n.*: {MOST_RUNS} at most"):
        study.plan()


@pytest.mark.parametrize("expression", ["+".join(["tilt"] * 5000), "-" * 3000 + "tilt", "(" * 300 + "tilt" + ")" * 300])
def test_a_deep_expression_is_one_error(tmp_path, expression):
    measure = {"tilt": {"columns": "simulation/base/tilt"}, "deep": {"derive": expression}}
    with pytest.raises(SolferError, match="cannot be computed"):
        made(tmp_path, measure=measure)
