"""What an installed wheel holds, and numbers that stand in two places."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

from pbrg_mj.scenario.robots import ROBOTS, robot_size
from pbrg_mj.world.scene.robot import load_robot_model

TOP = Path(__file__).parents[1]


@pytest.mark.parametrize("name", ROBOTS)
def test_the_scenario_package_reads_the_sizes_that_mujoco_reads(name):
    """It checks placements without MuJoCo."""
    robot, size = load_robot_model(name), robot_size(name)
    assert (size.body_radius, size.hand_offset) == pytest.approx((robot.body_radius, robot.hand_offset), abs=1e-12)


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)]
    subprocess.run(command, cwd=TOP, check=True, capture_output=True)
    return next(folder.glob("*.whl"))


def test_an_installed_wheel_runs_bundled_scenarios_from_any_folder(wheel, tmp_path):
    site, elsewhere = tmp_path / "site", tmp_path / "elsewhere"
    elsewhere.mkdir()
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(site)
    environment = {**os.environ, "PYTHONPATH": str(site)}  # the same kernels: the cache serves the wheel as well

    def pbrg(*arguments):
        program = "import sys, pbrg_mj.cli.main as m; print(m.__file__, file=sys.stderr); sys.exit(m.main())"
        command = [sys.executable, "-P", "-c", program, *arguments]
        return subprocess.run(command, cwd=elsewhere, env=environment, capture_output=True, text=True, check=False)

    listed = pbrg("list")
    assert str(site) in listed.stderr
    assert listed.stdout.count("paper/") == 4
    ran = pbrg("run", "paper/experiment_near", "--duration", "0.5", "-o", "near.mcap")
    assert ran.returncode == 0, ran.stderr
    assert (elsewhere / "near.mcap").stat().st_size > 10_000


def test_every_pinned_package_has_hashes_and_the_file_no_address():
    text = (TOP / "constraints.txt").read_text(encoding="utf-8")
    assert "//" not in text
    lines = [line for line in text.replace("\\\n", "").splitlines() if line and not line.startswith("# ")]
    assert len(lines) > 100
    for line in lines:
        assert re.fullmatch(r"[\w.-]+==\S+( +--hash=sha256:[0-9a-f]{64})+", line), line


def pinned(extras: str) -> set[str]:
    """The packages that scripts/setup installs with these extras."""
    selection = re.search(
        r"^awk .*?constraints\.txt", (TOP / "scripts" / "setup").read_text(), re.DOTALL | re.MULTILINE
    )
    assert selection is not None
    command = ["bash", "-c", f"extras={extras}\n{selection[0]}"]
    text = subprocess.run(command, cwd=TOP, check=True, capture_output=True, text=True).stdout
    return set(re.findall(r"^([\w.-]+)==", text, re.MULTILINE))


def test_set_up_installs_what_the_project_and_its_extras_name_and_hashes_decide():
    project = tomllib.loads((TOP / "pyproject.toml").read_text(encoding="utf-8"))["project"]

    def names(requirements):
        return {re.sub(r"[._]", "-", re.match(r"[\w.-]+", one)[0].lower()) for one in requirements}

    always, extras = names(project["dependencies"]), project["optional-dependencies"]
    assert always | {"hatchling", "editables"} <= pinned("")
    for extra, requirements in extras.items():
        assert always | names(requirements) <= pinned(extra), extra
    assert pinned("") < pinned("plot") < pinned(",".join(extras))
    installs = re.findall(r"^\S+install\[@\]\S+ (.*) >&2", (TOP / "scripts" / "setup").read_text(), re.MULTILINE)
    assert installs == ['--require-hashes -r "$pins"', "--no-build-isolation -e ."]
