"""What varies in a study, and which runs that makes."""

import re
import shutil

import numpy as np
import pytest
from support.unit.studies import CONFIG, STUDY, made, written

from solfer.errors import ConfigError, SolferError, SolferErrors
from solfer_tools.study import read_study

FRICTION = {"path": "simulation/friction/wheels", "grid": [0.3, 0.8]}
MASS = {"path": "simulation/mass", "grid": [0.9, 1.0, 1.1]}


def values(study, name, **options):
    return [run.variations[name] for run in study.plan(**options).runs]


def test_grids_go_with_each_other_and_lists_side_by_side(tmp_path):
    vary = {
        "friction": FRICTION,
        "mass": {"path": "simulation/mass", "list": [0.9, 1.1]},
        "noise": {"path": "simulation/noise", "list": [0.0, 2.0]},
    }
    runs = made(tmp_path, vary=vary).plan().runs
    assert [tuple(run.variations.values()) for run in runs] == [
        (0.3, 0.9, 0.0),
        (0.3, 1.1, 2.0),
        (0.8, 0.9, 0.0),
        (0.8, 1.1, 2.0),
    ]


def test_runs_of_one_point_have_seeds_of_their_own_and_those_of_other_points_the_same(tmp_path):
    runs = made(tmp_path, vary={"friction": FRICTION}, seed=7).plan(runs=3).runs
    assert [run.seed for run in runs] == [7, 8, 9, 7, 8, 9]
    assert len({run.id for run in runs}) == 6


def test_what_is_drawn_depends_on_the_seed_and_the_place_alone(tmp_path):
    vary = {
        "mass": {"path": "simulation/mass", "uniform": [0.8, 1.2]},
        "noise": {"path": "simulation/noise", "log_uniform": [0.1, 10.0]},
        "delay": {"path": "simulation/delay", "choice": [0.001, 0.004]},
    }
    study = made(tmp_path, vary=vary)
    many = values(study, "mass", runs=200)
    assert values(study, "mass", runs=50) == many[:50]
    assert 0.8 <= min(many) < 0.85 and 1.15 < max(many) <= 1.2
    noise = np.log10(values(study, "noise", runs=200))
    assert abs(noise.mean()) < 0.15 and noise.min() > -1.0 and noise.max() < 1.0
    assert set(values(study, "delay", runs=50)) == {0.001, 0.004}
    assert values(made(tmp_path, vary=vary, seed=1), "mass", runs=3) != many[:3]


def test_a_tag_varies_by_its_path(tmp_path):
    study = made(tmp_path, vary={"rest": {"path": "configuration/modules/wheeled_motion/rest", "grid": [True, False]}})
    first, second = study.plan().runs
    assert first.key != second.key
    _, over = study.settings(second.variations)
    assert over.plain() == {"modules": {"wheeled_motion": {"rest": False}}}


def test_a_place_of_a_list_varies_by_its_number(tmp_path):
    push = {"link": "pelvis", "at": 0.1, "force": [100.0, 0.0, 0.0]}
    vary = {"push": {"path": "simulation/pushes/0/force/1", "grid": [50.0]}}
    study = made(tmp_path, simulation={"pushes": [push]}, vary=vary)
    record, _ = study.settings(study.plan().runs[0].variations)
    assert record.simulation.pushes[0].force == (100.0, 50.0, 0.0)


def test_an_id_is_that_of_the_contents_wherever_the_files_lie(tmp_path):
    here, there = tmp_path / "here", tmp_path / "there"
    for folder in (here, there):
        folder.mkdir()
        shutil.copy(CONFIG / "studies/ahead_and_turn.yaml", folder / "motion.yaml")
    ids = [made(each, motion={"scenario": {"file": "motion.yaml"}}).plan().runs[0].id for each in (here, there)]
    assert ids[0] == ids[1]
    named = {name: {**each, "unit": "rad"} for name, each in STUDY["measure"].items()}
    assert made(there, motion={"scenario": {"file": "motion.yaml"}}, measure=named).plan().runs[0].id == ids[0]
    file = there / "motion.yaml"
    file.write_text(file.read_text().replace("dt: 0.01", "dt: 0.02"))
    other = made(there, motion={"scenario": {"file": str(file.rename(there / "other.yaml"))}})
    assert other.plan().runs[0].id != ids[0]


@pytest.mark.parametrize(
    ("tags", "part"),
    [
        ({"vary": {"mass": {"path": "simulation/mass", "grid": [0.9, 500.0]}}}, "vary.mass: expected a number"),
        ({"vary": {"mass": {"path": "simulaton/mass", "grid": [0.9]}}}, "did you mean: simulation"),
        ({"vary": {"mass": {"path": "simulation/mass", "grid": [1], "list": [1]}}}, "one of `grid`, `list`"),
        ({"vary": {"a": {"path": "configuration/modules/wheeled_motion/rst", "grid": [1]}}}, "unknown key 'rst'"),
        ({"vary": {"a": {"path": "configuration/modules", "grid": [1]}}}, "leads to no tag"),
        (
            {"vary": {"a": {"path": "configuration/modules/hands/stack", "grid": [1]}}},
            "unknown configuration of a plugin",
        ),
        ({"vary": {"a": {"path": "simulation/pushes/3", "grid": [1]}}}, "'3' is no place"),
        ({"measure": {"a": {"derive": "b + 1"}}}, "'b + 1' cannot be computed"),
        ({"measure": {"a": {"columns": "x", "derive": "b"}}}, "one of `columns` and `derive`"),
        ({"fails": {"fallen": "tlt > 0.5"}}, "'tlt > 0.5' cannot be computed"),
        ({"plugins": ["wheeled_moton"]}, "did you mean: wheeled_motion"),
        ({"simulation": {"robot": "centaro"}}, "did you mean: centauro"),
        ({"simulation": {"world": "flt"}}, "did you mean: flat"),
        ({"motion": {"scenario": {"file": "none.yaml"}}}, "none.yaml"),
        ({"duration": None}, "duration"),
    ],
    ids=lambda each: each if isinstance(each, str) else "",
)
def test_a_mistake_is_an_error_with_its_place_before_anything_runs(tmp_path, tags, part):
    tags = {"simulation": {"pushes": []}, **tags} if "vary" in tags else tags
    with pytest.raises((SolferError, SolferErrors)) as caught:
        made(tmp_path, **tags).plan()
    assert part in str(caught.value)
    assert "study.yaml:" in str(caught.value)


def test_a_list_of_another_length_is_an_error(tmp_path):
    vary = {
        "mass": {"path": "simulation/mass", "list": [1.0]},
        "noise": {"path": "simulation/noise", "list": [1.0, 2.0]},
    }
    with pytest.raises(ConfigError, match="lists of different lengths: mass, noise"):
        made(tmp_path, vary=vary)


def test_the_tutorial_shows_its_study(repository):
    page = (repository / "docs/tutorials/one_hundred_simulations.md").read_text()
    (shown,) = re.findall(r"```yaml\n(.*?)```", page, re.DOTALL)
    assert (CONFIG / "studies/hundred.yaml").read_text().endswith(shown)


def test_the_shipped_studies_can_run():
    names = [path.name for path in sorted((CONFIG / "studies").glob("*.yaml")) if "vary:" in path.read_text()]
    for name in names:
        assert len(read_study(CONFIG / "studies" / name).plan().runs) <= 200


def test_a_text_of_a_study_is_the_same_study_in_another_folder(tmp_path):
    from solfer_tools.study.plan import study_of

    study = read_study(written(tmp_path, vary={"mass": MASS}))
    again = study_of(study.text(), study.file)
    assert again.plan() == study.plan()


def test_other_code_makes_other_ids(tmp_path, monkeypatch):
    """Results of other code must not count as done: the hash has names and contents of all source files."""
    from solfer_tools.study import plan

    folder = tmp_path / "package"
    folder.mkdir()
    (folder / "first.py").write_text("a = 1")
    hashes = [plan.code_hash()]
    monkeypatch.setattr(plan, "CODE_FOLDERS", (folder,))
    for text in ("b = 1", "b = 2"):
        plan.code_hash.cache_clear()
        (folder / f"{text[-1]}.py").write_text(text)
        hashes.append(plan.code_hash())
    plan.code_hash.cache_clear()
    assert len(set(hashes)) == 3
    monkeypatch.undo()
    assert (plan.CODE_FOLDERS[1] / "study/plan.py").is_file() and plan.code_hash() == hashes[0]
