"""Files, bundled names and overrides."""

from pathlib import Path

import pytest

from pbrg_mj.errors import InputError
from pbrg_mj.scenario import bundled
from pbrg_mj.scenario.bundled import bundled_scenarios, data_dir
from pbrg_mj.scenario.load import load_scenario, parse_scenario
from pbrg_mj.scenario.parse.document import MOST_BYTES
from tests.scenario_texts import THREE, swapped


@pytest.fixture
def checkout(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A checkout with two bundled scenarios, and nothing in the folder we stand in."""
    (tmp_path / "repo" / "scenarios" / "paper").mkdir(parents=True)
    (tmp_path / "repo" / "pyproject.toml").touch()
    (tmp_path / "repo" / "scenarios" / "zoo.yaml").write_text(THREE)
    (tmp_path / "repo" / "scenarios" / "paper" / "experiment_near.yaml").write_text(swapped("seed: 3", "seed: 4"))
    (tmp_path / "here").mkdir()
    monkeypatch.setattr(bundled, "PACKAGE", tmp_path / "repo" / "pbrg_mj")
    monkeypatch.chdir(tmp_path / "here")
    return tmp_path / "repo"


@pytest.fixture
def three(tmp_path: Path) -> Path:
    path = tmp_path / "three.yaml"
    path.write_text(THREE)
    return path


def complaint(source: str | Path, *overrides: str) -> str:
    with pytest.raises(InputError) as caught:
        load_scenario(source, overrides)
    assert len(str(caught.value).splitlines()) == 1
    return str(caught.value)


def test_a_file_is_loaded_with_its_text(three: Path) -> None:
    loaded = load_scenario(three)
    assert (loaded.name, loaded.yaml_text) == ("three", THREE)
    assert loaded.scenario == load_scenario(str(three)).scenario == parse_scenario(THREE)
    scenario = loaded.scenario
    assert (scenario.robots, scenario.seed, scenario.team.leaders, scenario.operator.reference) == (
        3,
        3,
        (3,),
        (1, 2.5),
    )


def test_bundled_names_are_sorted_and_loaded(checkout: Path) -> None:
    assert list(bundled_scenarios()) == ["paper/experiment_near", "zoo"]
    for name in ("paper/experiment_near", "paper/experiment_near.yaml"):
        loaded = load_scenario(name)
        assert (loaded.name, loaded.scenario.seed) == ("paper/experiment_near", 4)


def test_a_file_goes_before_a_bundled_name_and_a_folder_does_not(checkout: Path) -> None:
    Path("zoo.yaml").write_text(swapped("seed: 3", "seed: 5"))
    Path("zoo").mkdir()
    assert load_scenario("zoo.yaml").scenario.seed == 5
    assert load_scenario("zoo").scenario.seed == 3


def test_data_of_an_installed_wheel_go_first(checkout: Path) -> None:
    assert data_dir("scenarios") == checkout / "scenarios"
    (checkout / "pbrg_mj" / "_data" / "scenarios").mkdir(parents=True)
    assert data_dir("scenarios") == checkout / "pbrg_mj" / "_data" / "scenarios"
    assert bundled_scenarios() == {}


def test_a_neighbour_of_an_installed_package_is_no_checkout(checkout: Path) -> None:
    (checkout / "pyproject.toml").unlink()
    with pytest.raises(FileNotFoundError, match="no bundled scenarios"):
        data_dir("scenarios")


def test_sources_that_are_not_there(checkout: Path) -> None:
    assert complaint("paper/experiment_ner") == (
        "'paper/experiment_ner' is neither a file nor a bundled scenario; did you mean paper/experiment_near?"
    )
    assert complaint("qqq") == "'qqq' is neither a file nor a bundled scenario; see: pbrg list"
    assert complaint("") == "the scenario's name is empty; allowed: a file, or a bundled name (see: pbrg list)"
    for odd in ("\0", "x\ny", "a" * 5000, "/" * 5000):
        complaint(odd)


def test_sources_that_are_no_text(tmp_path: Path) -> None:
    assert complaint(tmp_path) == f"{tmp_path}: is a folder; allowed: a scenario's YAML file"
    path = tmp_path / "x.yaml"
    path.write_bytes(b"seed: 1\n# caf\xe9\n")
    assert complaint(path) == f"{path}:2: is not UTF-8 text"
    path.write_bytes(b"#" * (MOST_BYTES - 1) + "é".encode())
    assert complaint(path) == f"{path}: is larger than 256 KiB, the most a scenario may be"
    path.write_bytes(b"")
    assert complaint(path) == f"{path}:1: is empty; allowed: a scenario in YAML"


def test_a_file_that_cannot_be_read(three: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_args: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "open", refuse)
    assert complaint(three) == f"{three}: cannot be read: Permission denied"


def test_a_byte_order_mark_and_windows_lines_are_fine(three: Path) -> None:
    three.write_bytes(b"\xef\xbb\xbf" + THREE.replace("\n", "\r\n").encode())
    loaded = load_scenario(three)
    assert loaded.scenario == parse_scenario(THREE)
    assert loaded.yaml_text == THREE.replace("\n", "\r\n")


def test_overrides_are_applied_and_written_out(three: Path) -> None:
    overrides = [
        "timing.duration=5",
        "governor.rounds = 20",
        "governor.kind=none",
        "team.start.1=[1, 9]",
        "team.start.0.1=1e-17",
        "team.heading_deg=0.1",
        "world.walls=[{from: [-3, 7], to: [3, 7]}]",
        "world.walls.0.thickness=0.30000000000000004",
        "description='yes: #1'",
        "governor.rounds=21",
    ]
    loaded = load_scenario(three, overrides)
    scenario = loaded.scenario
    assert (scenario.timing.duration, scenario.governor.rounds, scenario.governor.kind) == (5, 21, "none")
    assert scenario.team.start == ((0, 1e-17), (1, 9), (2, 0))
    assert (scenario.team.heading_deg, scenario.description) == (0.1, "yes: #1")
    assert scenario.world.walls[0].thickness == 0.30000000000000004
    assert parse_scenario(loaded.yaml_text) == scenario
    assert parse_scenario(THREE).governor.rounds == 10


@pytest.mark.parametrize(
    ("override", "expected"),
    [
        ("timing.duration", "override 'timing.duration'; allowed: path.to.key=value"),
        ("=5", "override '=5'; allowed: path.to.key=value"),
        ("timing..tick=5", "override 'timing..tick=5'; allowed: path.to.key=value"),
        ("seed=[", "override 'seed=[': the value is not YAML: expected the node content, but found '<stream end>'"),
        ("seed.x=1", "override 'seed.x=1': seed is 3, neither a section nor a list"),
        (
            "team.start.3=[1, 1]",
            "override 'team.start.3=[1, 1]': team.start has no entry '3'; allowed: an index from 0 to 2",
        ),
        (
            "team.start.-1=[1, 1]",
            "override 'team.start.-1=[1, 1]': team.start has no entry '-1'; allowed: an index from 0 to 2",
        ),
        ("goveror.rounds=5", "goveror: is unknown; did you mean `governor`?; set by override 'goveror.rounds=5'"),
        ("governor.runds=5", "governor.runds: is unknown; did you mean `rounds`?; set by override 'governor.runds=5'"),
        (
            "team.start=[[0, 0], [a, 1]]",
            "team.start.1.0: is 'a'; allowed: a number from -1e6 to 1e6; set by override 'team.start=[[0, 0], [a, 1]]'",
        ),
        (
            "governor.rounds='5'",
            (
                "governor.rounds: is '5'; allowed: a whole number from 1 to 10000 (a number stands without quotes); "
                "set by override \"governor.rounds='5'\""
            ),
        ),
        (
            "timing.duration=0.015",
            (
                "timing.duration: is 0.015 s; allowed: a whole multiple of timing.tick, 0.01 s; "
                "set by override 'timing.duration=0.015'"
            ),
        ),
        (
            "team={}",
            (
                "team.start: is missing; required: a list of 1 to 500 pairs of numbers from -1e6 to 1e6 (hand points "
                "q(0) in the world, one [x, y] per robot [m]); set by override 'team={}' (and 2 more)"
            ),
        ),
    ],
)
def test_an_override_that_is_wrong_is_named(three: Path, override: str, expected: str) -> None:
    assert complaint(three, override) == expected


def test_the_last_override_of_a_key_is_to_blame(three: Path) -> None:
    assert complaint(three, "governor.rounds=0", "governor={rounds: -1}").endswith("'governor={rounds: -1}'")
    assert complaint(three, "governor={rounds: -1}", "governor.rounds=0").endswith("'governor.rounds=0'")
