import json
import os
import signal
import subprocess
import sys
import time
import tomllib
from pathlib import Path

import pytest

from pbrg_mj.analysis.metrics.run_metrics import metrics
from pbrg_mj.analysis.metrics.table import COLUMN_WIDTH, LAYOUT, cell, comparison_table, shown
from pbrg_mj.api import doctor as checkup
from pbrg_mj.api import logs as api_logs
from pbrg_mj.cli.main import main
from pbrg_mj.errors import InputError
from pbrg_mj.log.read import run as reader
from pbrg_mj.scenario.load import load_scenario
from pbrg_mj.text import plain
from pbrg_mj.video import gl
from tests.needs import need_module
from tests.runs import replaced, run, walled

ROOT = Path(__file__).parents[1]
IDEAL = """
plant: ideal
timing: {duration: 0.5, tick: 0.05, physics_step: 0.05}
team: {start: [[0, 0], [0, -1]], formation: [[0, 0], [0, -1]], leaders: [2]}
graph: {kind: path}
estimator: {source: given, given: [{robot: 1, normal: [1, 0], offset: 2}]}
operator: {reference: [1, 0]}
"""


class PlantedRuns(dict):
    """Runs by the names of log files, which are there and empty."""

    def __setitem__(self, name, planted):
        Path(name).touch()
        super().__setitem__(name, planted)


@pytest.fixture
def logs(monkeypatch, tmp_path):
    """Planted runs in place of log files, by name."""
    found = PlantedRuns()
    monkeypatch.setattr(reader, "open_run", lambda path: replaced(found[Path(path).name], path=str(path)))
    monkeypatch.setattr(api_logs, "log_metrics", lambda path: metrics(reader.open_run(path)))
    monkeypatch.setattr(api_logs, "open_reduced", lambda path, _: (reader.open_run(path),) * 2)
    monkeypatch.chdir(tmp_path)
    return found


@pytest.fixture
def ideal(monkeypatch, tmp_path):
    (tmp_path / "ideal.yaml").write_text(IDEAL)
    monkeypatch.chdir(tmp_path)


def pbrg(*arguments, **options):
    command = [sys.executable, "-m", "pbrg_mj.cli.main", *arguments]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    return subprocess.run(command, capture_output=True, text=True, env=environment, check=False, **options)


def one_line(text):
    return text.count("\n") == 1 and text.startswith("error: ")


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ([], "Missing command"),
        (["nonsense"], "nonsense"),
        (["run"], "SCENARIO"),
        (["run", "no/such"], "no/such"),
        (["run", "ideal.yaml", "--seed", "x"], "seed"),
        (["run", "ideal.yaml", "--seed", "-1"], "seed"),
        (["run", "ideal.yaml", "--duration", "0.123"], "timing.duration"),
        (["run", "ideal.yaml", "--set", "governor.round=3"], "rounds"),
        (["run", "ideal.yaml", "-o", "ideal.yaml"], ".mcap"),
        (["run", "ideal.yaml", "-o", "missing/log.mcap"], "missing"),
        (["validate"], "FILE"),
        (["compare", "missing.mcap"], "missing.mcap"),
        (["compare", "ideal.yaml"], "ideal.yaml"),
        (["compare", "."], "folder"),
        (["export", "missing.mcap", "-o", "a.xlsx"], ".xlsx"),
        (["export", "missing.mcap"], "output"),
        (["plot", "missing.mcap", "-o", "a.gif"], ".gif"),
    ],
)
def test_wrong_input_is_one_line_and_exit_code_2(ideal, capsys, arguments, says):
    assert main(arguments) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert one_line(captured.err)
    assert says in captured.err
    assert [path.name for path in Path().iterdir()] == ["ideal.yaml"]


def test_validate_reports_every_file(ideal, capsys):
    Path("bad.yaml").write_text("team: 3\noperator: {reference: [1, 0]}\n")
    assert main(["validate", "bad.yaml", "ideal.yaml"]) == 2
    captured = capsys.readouterr()
    assert captured.out == "ideal.yaml: ok, 2 robots, ideal plant, 0.5 s\n"
    assert one_line(captured.err)
    assert "bad.yaml:1" in captured.err


def test_validate_tells_all_that_is_wrong_with_a_file_a_line_each(ideal, capsys):
    text = Path("ideal.yaml").read_text()
    Path("bad.yaml").write_text(
        f"{text}seeed: 1\nworld: {{boxes: [{{center: [1, 2]}}]}}\nsensors: {{beams: {{count: 0}}}}\n"
    )
    assert main(["validate", "bad.yaml"]) == 2
    end = text.count("\n")
    told = [line.split(": is ")[0] for line in capsys.readouterr().err.splitlines()]
    keys = "seeed", "world.boxes.0.size", "sensors.beams.count"
    assert told == [f"error: bad.yaml:{end + number}: {key}" for number, key in enumerate(keys, 1)]
    with pytest.raises(InputError) as error:
        load_scenario("bad.yaml")
    assert str(error.value).endswith(" (and 2 more)") and len(error.value.others) == 2


def test_list_names_the_bundled_scenarios(capsys):
    assert main(["list"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert any(line.startswith("paper/experiment_near ") for line in lines)
    assert all(len(line.split(maxsplit=1)) == 2 for line in lines)


def test_run_prints_json_alone_and_writes_the_log(ideal, capsys):
    assert main(["run", "ideal.yaml", "--json", "--seed", "7", "--set", "reference.solver=none"]) == 0
    captured = capsys.readouterr()
    found = json.loads(captured.out)
    assert (found["log"], found["seed"], found["duration_s"], found["ticks"]) == ("ideal.mcap", 7, 0.5, 11)
    assert captured.err == ""
    assert Path("ideal.mcap").stat().st_size > 0


def test_quiet_says_nothing_and_the_summary_says_the_outcome(ideal, capsys):
    assert main(["run", "ideal.yaml", "--quiet", "-o", "a.mcap"]) == 0
    assert capsys.readouterr() == ("", "")
    assert main(["run", "ideal.yaml", "-o", "b.mcap"]) == 0
    assert "outcome" in capsys.readouterr().out


def test_a_violated_run_exits_with_1(ideal, capsys):
    """The team starts beyond its line."""
    override = "estimator.given.0.offset=-1"
    assert main(["run", "ideal.yaml", "--set", override, "--json", "-o", "log.mcap"]) == 1
    assert json.loads(capsys.readouterr().out)["outcome"] == "violated"


@pytest.mark.skipif(sys.platform == "darwin", reason="its file names are UTF-8")
def test_a_file_s_name_need_not_be_utf_8(ideal, capsys):
    """The name goes into the log, where texts are UTF-8."""
    file = os.fsdecode(b"bad\xff.yaml")
    Path("ideal.yaml").rename(file)
    assert main(["run", file, "--quiet"]) == 0
    assert {path.name for path in Path().iterdir()} == {file, "bad\\xff.mcap"}
    assert main(["compare", "bad\\xff.mcap", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)[0]["scenario"] == "bad\\xff"


def test_a_backend_of_matplotlib_that_is_not_there_is_not_asked_for():
    code = "from pbrg_mj.cli.main import main; assert main(['--version']) == 0; import matplotlib"
    environment = os.environ | {"PYTHONPATH": str(ROOT), "MPLBACKEND": "nosuch"}
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, env=environment)


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGHUP, 129)])
def test_ctrl_c_and_other_ends_leave_a_whole_log(ideal, number, code):
    command = [sys.executable, "-m", "pbrg_mj.cli.main", "run", "ideal.yaml", "--duration", "5000"]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=environment) as process:
        while not Path("ideal.mcap.part").exists():
            assert process.poll() is None
            time.sleep(0.01)
        process.send_signal(number)
        _, errors = process.communicate()
    assert process.returncode == code
    assert errors == "interrupted; the log so far: ideal.mcap\n"
    assert not Path("ideal.mcap.part").exists()
    found = reader.open_run("ideal.mcap")
    assert (found.damage, found.ending_text) == (None, f"interrupted ({signal.Signals(number).name})")
    assert len(found.ticks.time) >= 1


def test_compare_s_table_holds_the_json_s_values(logs, capsys):
    logs["a.mcap"], logs["b.mcap"] = run(), replaced(run(walled()), name="other")
    assert main(["compare", "a.mcap", "b.mcap", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert [one["scenario"] for one in found] == ["planted", "other"]
    assert main(["compare", "a.mcap", "b.mcap"]) == 0
    lines = capsys.readouterr().out.splitlines()
    for rows in LAYOUT.values():
        for label, key in rows:
            line = next(line for line in lines if line.startswith(f"  {label}  "))
            cells = " ".join(cell(shown(one, key)) for one in found).split()
            assert line.split()[-len(cells) :] == cells, key
    assert max(map(len, lines)) <= 100


@pytest.mark.parametrize(
    ("count", "said"), [(0.0, "0 B"), (999.0, "999 B"), (704e3, "704 kB"), (1.4081e3, "1.408 kB"), (2.5e15, "2500 TB")]
)
def test_bytes_stand_in_the_table_with_a_unit_that_a_person_reads(count, said):
    assert shown({"centralized": False, "sent_bytes": count}, "sent_bytes") == said


def test_every_metric_stands_in_the_table():
    keys = {key for rows in LAYOUT.values() for _, key in rows}
    nested = metrics(run()).as_dict()
    flat = {f"{name}.{k}" for name, one in nested.items() if isinstance(one, dict) for k in one}
    flat |= {name for name, one in nested.items() if not isinstance(one, dict)}
    # Marked beside the governor's name and the share of its own certificate.
    assert flat - keys == {"damage", "violation_kind", "centralized", "own_certificate_violated_share"}
    assert keys <= flat


def test_long_names_keep_their_end():
    table = comparison_table([metrics(run(path="far/" * 20 + "run.mcap"))])
    assert max(map(len, table.splitlines())) <= 100
    assert "far/run.mcap" in table
    assert len(cell("x" * 99)) == COLUMN_WIDTH


def test_damage_is_told_on_stderr(logs, capsys):
    logs["a.mcap"] = run(damage="cut at byte 12")
    assert main(["compare", "a.mcap", "--json"]) == 0
    captured = capsys.readouterr()
    assert json.loads(captured.out)[0]["damage"] == "cut at byte 12"
    assert captured.err == "warning: a.mcap: cut at byte 12\n"


def test_text_from_a_log_cannot_drive_the_terminal(logs, capsys):
    logs["a.mcap"] = run(name="\x1b]0;gone\x07\n[red]x", damage="\x1b[2J\r\u202e")
    assert main(["compare", "a.mcap"]) == 0
    captured = capsys.readouterr()
    assert "\x1b" not in captured.out + captured.err
    assert "\\x1b]0;gone\\x07\\n[red]x" in captured.out
    assert captured.err == "warning: a.mcap: \\x1b[2J\\r\\u202e\n"


def test_plain_spells_out_what_acts():
    assert plain("a\x00b\x9b\u2028c\né", keep="\n") == "a\\x00b\\x9b\\u2028c\né"


def test_export_and_plot_write_their_files(logs, capsys):
    logs["a.mcap"] = run()
    for name in ("a.csv", "a.npz", "a.mat"):
        assert main(["export", "a.mcap", "-o", name]) == 0
        assert Path(name).stat().st_size > 0
    need_module("matplotlib")
    assert main(["plot", "a.mcap", "-o", "a.svg"]) == 0
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("code", "heavy"),
    [
        (
            "from pbrg_mj.cli.main import main; main(['--help'])",
            {"numpy", "scipy", "mujoco", "numba", "cvxpy", "pydantic", "mcap", "rich", "matplotlib"},
        ),
        (
            "import pbrg_mj.api.simulate",
            {"scipy.stats", "scipy.ndimage", "scipy.optimize", "scipy.spatial", "cvxpy", "matplotlib", "rich"},
        ),
    ],
    ids=["help", "run"],
)
def test_nothing_heavy_is_imported_that_is_not_used(code, heavy):
    code += f"; import sys; assert not {heavy!r} & set(sys.modules), {heavy!r} & set(sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, cwd=ROOT)


def test_version(capsys):
    assert main(["--version"]) == 0
    assert capsys.readouterr().out.startswith("pbrg ")


def test_doctor_knows_every_required_package():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert set(checkup.REQUIRED) == {one.split(">")[0] for one in project["dependencies"]}
    extras = {name: some for name, some in project["optional-dependencies"].items() if name not in ("dev", "docs")}
    assert set(checkup.OPTIONAL) == {one.split(">")[0] for some in extras.values() for one in some}


def test_doctor(monkeypatch, capsys):
    broken = {"works": False, "error": "no \x1b library", "packages": ["libosmesa6"]}
    monkeypatch.setattr(checkup, "probe_gl", lambda _backend: broken)
    assert main(["doctor", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["gl"]["egl"] == broken
    assert found["required"]["mujoco"].startswith("4.")
    assert main(["doctor"]) == 0
    assert "does not work (no \\x1b library); on Debian: apt install libosmesa6" in capsys.readouterr().out


def test_doctor_misses_a_required_package(monkeypatch, capsys):
    monkeypatch.setattr(checkup, "probe_gl", lambda _backend: {"works": True, "error": None, "packages": []})
    monkeypatch.setattr(checkup, "REQUIRED", ("numpy", "no-such-package"))
    assert main(["doctor"]) == 1
    assert "MISSING: pip install no-such-package" in capsys.readouterr().out


def test_doctor_never_sets_the_variable_here(monkeypatch):
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    monkeypatch.setattr(gl, "PROBE", "import os; raise SystemExit(os.environ['MUJOCO_GL'] != 'egl')")
    found = checkup.doctor()["gl"]
    assert (found["egl"]["works"], found["osmesa"]["works"]) == (True, False)
    assert "MUJOCO_GL" not in os.environ
