import csv

import numpy as np
import pytest
from scipy.io import loadmat

from pbrg_mj.analysis import export as exporting
from pbrg_mj.analysis.export import RunArrays, export
from pbrg_mj.analysis.figures.figure import plot
from pbrg_mj.analysis.series import series
from pbrg_mj.errors import InputError
from tests.runs import optima, replaced, run, scenario, timings, walled

SOLVED = np.arange(0, 21, 4)


def varied(seed=3):
    """A run in which no two numbers are the same."""
    rng = np.random.default_rng(seed)
    made = run()
    names = [name for name, values in vars(made.ticks).items() if values.dtype == float]
    ticks = replaced(made.ticks, **{name: rng.normal(size=getattr(made.ticks, name).shape) for name in names})
    return replaced(made, ticks=ticks, optima=replaced(made.optima, m=rng.normal(size=made.optima.m.shape)))


def test_npz_holds_every_array_bit_for_bit(tmp_path):
    made = varied()
    export(made, tmp_path / "run.npz")
    with np.load(tmp_path / "run.npz", allow_pickle=False) as file:
        assert set(file) == set(RunArrays(made))
        for name, values in RunArrays(made).items():
            np.testing.assert_array_equal(file[name], values)
        np.testing.assert_array_equal(file["q_true_m"], made.ticks.hand_true)
        np.testing.assert_array_equal(file["q_m"], made.ticks.hand)
        np.testing.assert_array_equal(file["body_true_m"], made.ticks.body_pose_true[..., :2])
        np.testing.assert_array_equal(file["body_m"], made.ticks.body_pose[..., :2])
        np.testing.assert_array_equal(file["u_m_s"], made.ticks.velocity)
        np.testing.assert_array_equal(file["p_m"], made.ticks.p)
        np.testing.assert_array_equal(file["m_star_m"], made.optima.m)
        assert str(file["scenario_yaml"]) == "seed: 1\n"


@pytest.mark.parametrize("block", [0, 2**20])
def test_mat_holds_every_number_bit_for_bit(tmp_path, monkeypatch, block):
    """Also where arrays count as large, and are written in columns."""
    monkeypatch.setattr(exporting, "MAT_BLOCK", block)
    made = varied()
    export(made, tmp_path / "run.mat")
    file = loadmat(tmp_path / "run.mat")
    for name, values in RunArrays(made).items():
        assert name in file
        if values.dtype.kind in "if" and values.ndim:
            np.testing.assert_array_equal(file[name].reshape(values.shape), values)
    assert file["status"][0].strip() == "ok"


def test_csv_is_one_row_per_tick_with_named_columns(tmp_path):
    made = varied()
    export(made, tmp_path / "run.csv")
    with (tmp_path / "run.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 21
    assert [float(row["q_true_y_2_m"]) for row in rows] == made.ticks.hand_true[:, 1, 1].tolist()
    assert [float(row["heading_true_1_rad"]) for row in rows] == made.ticks.body_pose_true[:, 0, 2].tolist()
    assert [float(row["lambda_1_2"]) for row in rows] == made.ticks.multipliers[:, 0, 1].tolist()
    assert [float(row["half_space_G_x_2_1"]) for row in rows] == made.ticks.half_space_G[:, 1, 0, 0].tolist()
    assert {row["wall_contact_1"] for row in rows} == {"0"}


def test_csv_leaves_blank_what_a_tick_does_not_have(tmp_path):
    made = varied()
    export(made, tmp_path / "run.csv")
    with (tmp_path / "run.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    filled = {t: float(row["m_star_x_m"]) for t, row in enumerate(rows) if row["m_star_x_m"]}
    assert filled == dict(zip(SOLVED.tolist(), made.optima.m[:, 0].tolist(), strict=True))
    assert [row["reference_status"] for row in rows[:5]] == ["solved", "", "", "", "solved"]


def test_every_column_has_a_name_of_its_own():
    names = [name for one in series(varied()) for name, _ in one.columns()]
    assert len(names) == len(set(names))
    assert all(name.isidentifier() or name == "lambda" for name in RunArrays(varied()))


@pytest.mark.parametrize("suffix", [".npz", ".mat", ".csv"])
def test_the_same_run_gives_the_same_bytes(tmp_path, suffix):
    for name in "ab":
        export(varied(), tmp_path / f"{name}{suffix}")
    assert (tmp_path / f"a{suffix}").read_bytes() == (tmp_path / f"b{suffix}").read_bytes()


@pytest.mark.parametrize("suffix", [".npz", ".mat", ".csv"])
def test_a_run_without_reference_timings_or_half_spaces(tmp_path, suffix):
    bare = run(optima=optima(scenario(), 0), timings=timings(0))
    export(bare, tmp_path / f"bare{suffix}")
    assert (tmp_path / f"bare{suffix}").stat().st_size > 0


@pytest.mark.parametrize("name", ["run.xlsx", "run", "run.npz.gz"])
@pytest.mark.parametrize("write", [export, plot])
def test_an_unknown_suffix_is_refused_and_nothing_written(tmp_path, write, name):
    with pytest.raises(InputError, match=r"allowed: (\.npz, \.mat, \.csv|\.pdf, \.png, \.svg)"):
        write(run(), tmp_path / name)
    assert not list(tmp_path.iterdir())


def test_a_failed_export_leaves_the_old_file_and_nothing_else(tmp_path):
    (tmp_path / "run.csv").write_text("old")
    broken = varied()
    broken = replaced(broken, ticks=replaced(broken.ticks, rounds=np.zeros(3, dtype=int)))
    with pytest.raises(IndexError):
        export(broken, tmp_path / "run.csv")
    assert [path.name for path in tmp_path.iterdir()] == ["run.csv"]
    assert (tmp_path / "run.csv").read_text() == "old"


def test_a_folder_that_is_not_there(tmp_path):
    with pytest.raises(InputError, match="cannot write here: No such file"):
        export(run(), tmp_path / "missing" / "run.csv")


def test_the_command_carries_the_unit_of_the_drive() -> None:
    plans = {
        "command_V": walled(),
        "command_rad_s": walled(drive={"kind": "speed_loop"}),
        "command_m_s": scenario(),
    }
    for name, plan in plans.items():
        assert [s.key for s in series(run(plan)) if s.name == "command"] == [name]
