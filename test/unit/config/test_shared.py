"""Lists of plugins: of a shared plugin, and of an RT layer in which a shared plugin stands."""

import logging
from pathlib import Path

import pytest

from solfer.config import CheckReport, check, load, load_shared
from solfer.config.loading.rt_layer import read_layer
from solfer.config.yaml import files
from solfer.errors import ConfigError, SolferError, UnknownName

GROUPS = """    slow: {layer: NRT, robot: offline, controller: [broadcast], mode: full, kinematics: true,
      dynamics: true, model_change: true, class: "my.slow:Slow", secondary_file: {file: slow.yaml}, speed: 1.0}
    needy: {layer: NRT, robot: offline, controller: [broadcast], mode: full, kinematics: true, dynamics: true,
      model_change: true, class: "my.needy:Needy", requires: [player]}
    shared: {layer: NRT, mode: idle, plugins: [LIST]}
"""
LAYER = "XBotRTPlugins: {plugins: [LIST]}\nmwoibn: {config_file: main.yaml}\nexecutor: {start: [START]}\n"


@pytest.fixture
def folder(repository, tmp_path, monkeypatch):
    """Make a folder with a main configuration and the file of an RT layer; the working directory."""
    for path in (repository / "test/data/config").iterdir():
        (tmp_path / path.name).symlink_to(path)
    text = (tmp_path / "main.yaml").read_text().replace("  layers:\n", "  layers:\n    RT: {file: layer.yaml}\n")
    text = text.replace("  ros:\n", "  ros: &ros\n").replace("  modules:\n", "  xbot: *ros\n  modules:\n")
    (tmp_path / "main.yaml").unlink()
    (tmp_path / "main.yaml").write_text(text.replace("NRT\n      robot: online", "NRT\n      robot: offline"))
    (tmp_path / "slow.yaml").write_text("mwoibn:\n  robot: {rate: 50}\n")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def shared(folder, plugins, **changes):
    """Load a shared plugin with a list of plugins."""
    text = (folder / "main.yaml").read_text() + GROUPS.replace("LIST", plugins)
    for right, wrong in changes.items():
        assert right in text
        text = text.replace(right, wrong)
    (folder / "shared.yaml").write_text(text)
    return load_shared("shared.yaml")


def layer(folder, plugins, start="", inner="player, needy"):
    """Read an RT layer with a list of plugins."""
    main = (folder / "main.yaml").read_text()
    (folder / "main.yaml").write_text(main + GROUPS.replace("LIST", inner))
    (folder / "rt.yaml").write_text(LAYER.replace("LIST", plugins).replace("START", start))
    return read_layer("rt.yaml")


def test_names_are_made_unique_and_logged(folder, caplog):
    caplog.set_level(logging.INFO)
    loaded = shared(folder, "'a::player', 'b::player', player, 'c::needy'")
    assert [each.name for each in loaded.plugins] == ["player", "player_2", "player_3", "needy"]
    assert [each.plugin for each in loaded.plugins] == ["a", "b", "player", "c"]
    assert [each.configuration.module.name for each in loaded.plugins] == [each.name for each in loaded.plugins]
    assert {each.configuration.name for each in loaded.plugins[:3]} == {"player"}
    assert all(f"again: here it is named '{name}'" in caplog.text for name in ("player_2", "player_3"))


def test_unique_names_keep_their_places_and_tags(folder):
    first, second = shared(folder, "player, player").configurations
    assert first.module.where("robot") == second.module.where("robot") != ""
    assert first.text() == second.text()


def test_a_unique_name_avoids_a_listed_configuration(folder):
    text = (folder / "main.yaml").read_text()
    (folder / "main.yaml").write_text(
        f"{text}    player_2: {{layer: NRT, robot: offline, controller: [broadcast], "
        "mode: idle, kinematics: false, dynamics: false, model_change: false}\n"
    )
    loaded = shared(folder, "player, player, player_2")
    assert [each.name for each in loaded.plugins] == ["player", "player_3", "player_2"]


def test_plugins_of_different_rates_are_refused(folder):
    with pytest.raises(ConfigError, match="'slow' has 50 Hz, and 'player' 200 Hz, in the shared plugin") as error:
        shared(folder, "player, slow")
    assert error.value.where.startswith("slow.yaml:2:") and "layer.yaml:2:" in error.value.expected


def test_required_components_are_those_of_the_list(folder):
    loaded = shared(folder, "player, needy")
    assert [each.requires for each in loaded.plugins] == [(), ("player",)]
    with pytest.raises(UnknownName, match="unknown component of the shared plugin 'shared' 'player'") as error:
        shared(folder, "mover, needy")
    assert error.value.where.startswith("shared.yaml:") and "requires[0]" in error.value.where


def test_a_misspelt_required_component_has_near_names(folder):
    with pytest.raises(UnknownName) as error:
        shared(folder, "player, needy", **{"requires: [player]": "requires: [playr]"})
    assert error.value.names == ("player",)


def test_a_component_cannot_require_itself(folder):
    with pytest.raises(ConfigError, match="'needy' requires itself"):
        shared(folder, "needy", **{"requires: [player]": "requires: [needy]"})


def test_a_layer_expands_a_shared_plugin(folder):
    read = layer(folder, "mover, shared", start="shared")
    assert [(each.name, each.mark.file) for each in read.plugins] == [
        ("mover", "rt.yaml"),
        ("player", "main.yaml"),
        ("needy", "main.yaml"),
    ]
    assert read.start == ("player", "needy")
    loaded = read.load()
    assert (load("main.yaml", "needy").module.mode, loaded[2].configuration.module.mode) == ("full", "idle")
    assert {(each.configuration.middleware, each.configuration.module.layer) for each in loaded} == {("XBOT", "RT")}
    assert loaded[2].requires == ("player",) and loaded[1].where.startswith("main.yaml:")


def test_names_are_unique_in_the_whole_layer(folder):
    read = layer(folder, "player, 'shared::shared', mover", start="player_2")
    assert [each.name for each in read.plugins] == ["player", "player_2", "needy", "mover"]
    assert read.start == ("player_2",)


def test_a_group_starts_only_as_a_whole(folder):
    with pytest.raises(ConfigError, match="'shard' starts by itself and is not among the plugins") as error:
        layer(folder, "mover, shared", start="shard")
    assert "shared" in error.value.expected and "start[0]" in error.value.where


@pytest.mark.parametrize(
    ("plugins", "inner", "words"),
    [
        ("'mover::shared'", "player", "'shared' lists plugins and is not one itself"),
        ("shared", "player, slow", "'slow' has 50 Hz"),
        ("shared", "needy", "unknown component of the RT layer 'player'"),
        ("shared", "playr", "unknown plugin 'playr'"),
        ("shared", "shared", "'shared' lists plugins and is not one itself"),
    ],
)
def test_mistakes_in_an_expanded_list_are_found(folder, plugins, inner, words):
    read = layer(folder, plugins, inner=inner)
    with pytest.raises(SolferError) as error:
        read.load()
    assert words in str(error.value) and ".yaml:" in str(error.value)


def test_a_required_component_may_stand_outside_the_group(folder):
    loaded = layer(folder, "player, shared", inner="needy").load()
    assert [each.name for each in loaded] == ["player", "needy"]


def test_a_check_finds_what_loading_refuses(folder):
    text = (folder / "main.yaml").read_text()
    (folder / "main.yaml").write_text(text + GROUPS.replace("LIST", "player, player, slow"))
    report = check("main.yaml")
    assert isinstance(report, CheckReport) and "shared" not in report.shared
    assert any("'slow' has 50 Hz" in str(each) for each in report.errors)
    assert any("named 'player_2'" in each.what for each in report.information)


def test_every_file_is_read_once(folder, monkeypatch):
    read = []
    content = files.read_bytes
    monkeypatch.setattr(files, "read_bytes", lambda path: read.append(Path(path).name) or content(path))
    shared(folder, "player, needy, player")
    assert sorted(read) == sorted(set(read)) and "layer.yaml" in read
    read.clear()
    load("main.yaml", "mover")
    assert sorted(read) == sorted({"main.yaml", "system.yaml", "layer.yaml", "secondary.yaml"})
    read.clear()
    layer(folder, "mover, shared").load()
    assert sorted(read) == sorted(set(read)) and {"rt.yaml", "main.yaml", "secondary.yaml"} <= set(read)


def test_a_required_component_with_mistakes_is_known(folder):
    with pytest.raises(SolferError) as error:
        shared(folder, "player, needy", **{"controller: [broadcast]\n": "controller: [broadcst]\n"})
    assert "'broadcst'" in str(error.value) and "unknown component" not in str(error.value)
