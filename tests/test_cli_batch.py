"""`pbrg batch`: batch_metrics of many seeds, arrays in a file, one line for a wrong input."""

import json

import numpy as np
import pytest

from pbrg_mj.api.seeds import MOST, seeds_of
from pbrg_mj.cli.main import main
from pbrg_mj.errors import InputError

NEAR = ["batch", "paper/experiment_near", "--duration", "0.2", "--seeds", "5-7,1"]
AT_THE_WALL = "team.start=[[1.52,1.52],[-1,-1],[0,-1],[1,-1],[0,0]]"  # nobody fits there: 2 cm past the line


def test_figures_and_arrays(tmp_path, capsys):
    out = tmp_path / "worlds.npz"
    assert main([*NEAR, "--json", "-o", str(out)]) == 0
    numbers = json.loads(capsys.readouterr().out)
    arrays = np.load(out)
    assert arrays["seeds"].tolist() == [5, 6, 7, 1]
    assert arrays["hand_world_m"].shape == arrays["m_m"].shape == (4, 21, 5, 2)
    least = arrays["wall_margin_m"].min(axis=(1, 2))
    assert numbers["true_margin_m"] == {"min": least.min(), "median": np.median(least), "max": least.max()}
    assert numbers["worst_seed"] == arrays["seeds"][least.argmin()]
    assert (numbers["worlds"], numbers["worlds_touching"], numbers["worlds_diverged"]) == (4, 0, 0)
    places = arrays["hand_world_m"][:, -1]
    deviation = np.sqrt(np.mean((places - places.mean(axis=0)) ** 2, axis=0).sum(axis=1)).max()
    assert numbers["final_place_std_m"] == pytest.approx(deviation) and deviation > 1e-6


def test_a_violated_world_is_exit_code_1_and_text_has_every_figure(capsys):
    assert main([*NEAR[:4], "--seeds", "1,2", "--set", AT_THE_WALL]) == 1
    lines = dict(line.split(maxsplit=1) for line in capsys.readouterr().out.splitlines())
    assert lines["worlds_past_a_wall"] == "2"
    assert float(lines["true_margin_m.min"]) < 0


@pytest.mark.parametrize("text", ["", "1-", "8-1", "a", "1;2", "-3", f"1-{MOST + 1}", str(2**63), "1,,2"])
def test_seeds_that_are_none_are_refused_in_one_line(text, capsys):
    with pytest.raises(InputError):
        seeds_of(text)
    assert main([*NEAR[:4], f"--seeds={text}"]) == 2
    said = capsys.readouterr().err
    assert said.startswith("error: --seeds is") and said.count("\n") == 1


def test_a_hopeless_file_is_refused_before_the_run(tmp_path, capsys):
    assert main([*NEAR, "-o", str(tmp_path / "worlds.csv")]) == 2
    assert main([*NEAR, "-o", str(tmp_path / "none" / "worlds.npz")]) == 2
    assert main(["batch", "paper/simulation_nea"]) == 2
    assert capsys.readouterr().err.count("\n") == 3
    assert list(tmp_path.iterdir()) == []
