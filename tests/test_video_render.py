"""Videos and stills made of logs, decoded again."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pbrg_mj.cli.main import main
from pbrg_mj.errors import InputError
from pbrg_mj.log.read import run as reader
from pbrg_mj.log.read.run import open_run
from pbrg_mj.log.read.scans import read_scans
from pbrg_mj.scenario.schema import beam_angles
from pbrg_mj.video import gl, render
from pbrg_mj.video.camera import camera_path
from pbrg_mj.video.encode import write_movie
from pbrg_mj.video.playback import motion_of
from pbrg_mj.video.render import ViewSettings, render_movie, render_still
from pbrg_mj.video.settings import Clip
from pbrg_mj.world.plant.compose import compose
from pbrg_mj.world.scene.robot import load_robot_model
from tests.needs import need, need_module
from tests.runs import replaced, resting, run, scenario

av = need_module("av")
Image, ImageSequence = need_module("PIL.Image"), need_module("PIL.ImageSequence")
SIZE = (320, 180)
BARE = ViewSettings(camera="top", size=SIZE, layers=frozenset())


@pytest.fixture(scope="session")
def backend():
    """Skip where nothing can be drawn; .ci/run installs what it takes."""
    try:
        return gl.working_backend()
    except InputError as error:
        need(False, str(error))


@pytest.fixture
def draws(monkeypatch, backend):
    """Probe once for all tests."""
    monkeypatch.setattr(render, "working_backend", lambda: backend)


@pytest.fixture(scope="session")
def log(tmp_path_factory):
    """A second of the paper's experiment: physics, and robot 5 with beams."""
    path = tmp_path_factory.mktemp("video") / "near.mcap"
    assert main(["run", "paper/experiment_near", "--duration", "1", "--quiet", "-o", str(path)]) == 0
    return path


def moving():
    """Two robots that part along x, one turned to the left."""
    ticks = resting(scenario())
    way = np.linspace(0, 1.5, 21)[:, None, None] * [[1.0, 0.0], [-1.0, 0.0]]
    q = ticks.hand_true + way
    pose = np.concatenate([q, np.broadcast_to([[0.0], [np.pi / 2]], (21, 2, 1))], axis=2)
    return run(ticks={"hand_true": q, "body_pose_true": pose, "reference": np.full((21, 2), [1.0, 0.5])})


def pictures(path):
    if path.suffix == ".webp":  # PyAV writes animations, but does not read them
        with Image.open(path) as video:
            return [np.asarray(frame.convert("RGB")) for frame in ImageSequence.Iterator(video)]
    with av.open(str(path)) as container:
        return [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]


def hue(picture, pixel):
    """Return the colour at a pixel as shares of its sum: light changes brightness alone."""
    x, y = np.round(pixel).astype(int)
    patch = picture[y - 1 : y + 2, x - 1 : x + 2].reshape(-1, 3).mean(axis=0)
    return patch / patch.sum()


def assert_robots_where_the_log_says(made, time, picture):
    motion = motion_of(made.ticks)
    camera = camera_path(render._task(made, render.Path("x.mp4"), BARE, made.ticks.time), motion)(time)
    model = compose(made.scenario, load_robot_model()).compile()
    for robot, (x, y, heading) in enumerate(motion.at(time)[0]):
        # beside the white marks on its top
        beside = [x - 0.035 * np.sin(heading), y + 0.035 * np.cos(heading), 0.054]
        (pixel,) = camera.project(np.array([beside]), SIZE)
        colour = model.geom(f"robot{robot}/bumper").rgba[:3]
        np.testing.assert_allclose(
            hue(picture, pixel), colour / colour.sum(), atol=0.08
        )  # chroma has half of the pixels


@pytest.mark.render
@pytest.mark.parametrize("suffix", [".mp4", ".webm", ".gif", ".webp"])
def test_a_film_has_its_frames_with_the_robots_where_the_log_says(draws, tmp_path, suffix):
    made, path, count = moving(), tmp_path / f"video{suffix}", []
    render_movie(made, path, BARE, Clip(fps=5.0, speed=5.0, start=2.0, end=10.0), lambda: count.append(1))
    frames = pictures(path)
    assert len(frames) == len(count) == 8
    assert frames[0].shape == (180, 320, 3)
    for k, picture in enumerate(frames):
        assert_robots_where_the_log_says(made, 2.0 + k, picture)
    assert [file.name for file in tmp_path.iterdir()] == [path.name]


@pytest.mark.render
def test_a_still_shows_what_is_not_hidden(draws, tmp_path):
    """r at (1, 0.5) is marked in red, the half-space x <= 2 in its robot's colour; neither when hidden."""
    made, made_of = moving(), {}
    for name, layers in {"bare": (), "marked": ("references", "half_spaces"), "told": ("text",)}.items():
        path = tmp_path / f"{name}.png"
        render_still(made, path, replaced(BARE, layers=frozenset(layers)), 10.0)
        made_of[name] = pictures(path)[0].astype(int)
    camera = camera_path(render._task(made, tmp_path / "x.png", BARE, made.ticks.time), motion_of(made.ticks))(10.0)
    ((x, y),) = np.round(camera.project(np.array([[1.0, 0.5, 0.0]]), SIZE)).astype(int)
    red, _, blue = made_of["marked"][y, x]
    assert red > 2 * blue
    assert abs(made_of["bare"][y, x, 0] - made_of["bare"][y, x, 2]) < 12  # the floor is grey
    ((x, y),) = np.round(camera.project(np.array([[2.05, 0.8, 0.0]]), SIZE)).astype(int)
    assert (made_of["marked"][y, x] != made_of["bare"][y, x]).any()
    changed = (made_of["told"] != made_of["bare"]).any(axis=2)
    assert changed[:40, :80].mean() > 0.7
    assert not changed[140:].any()


@pytest.mark.render
@pytest.mark.parametrize("suffix", [".mp4", ".webp"])
def test_the_same_log_makes_the_same_film(draws, log, tmp_path, suffix):
    videos = [tmp_path / f"a{suffix}", tmp_path / f"b{suffix}"]
    for path in videos:
        assert main(["render", str(log), "-o", str(path), "--size", "160x90", "--fps", "10"]) == 0
    assert videos[0].read_bytes() == videos[1].read_bytes()
    assert len(pictures(videos[0])) == 10


def test_an_animated_picture_plays_over_and_over_at_its_rate(tmp_path):
    black = np.zeros((91, 161, 3), dtype=np.uint8)  # no side need be even
    write_movie([black, black + 200, black], tmp_path / "a.webp", 5.0, lambda: None)
    with Image.open(tmp_path / "a.webp") as video:
        assert video.size == (161, 91)
        assert video.info["loop"] == 0
        frames = [
            (frame.getpixel((80, 45))[0] > 100, frame.info["duration"]) for frame in ImageSequence.Iterator(video)
        ]
    assert frames == [(False, 200), (True, 200), (False, 200)]


@pytest.mark.render
def test_a_log_cut_anywhere_films_what_whole_chunks_hold(draws, log, tmp_path, capsys):
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(log.read_bytes()[: int(0.7 * log.stat().st_size)])
    ticks = open_run(cut).ticks
    assert 10 <= len(ticks.time) < 100
    assert main(["render", str(cut), "-o", str(tmp_path / "cut.mp4"), "--size", "160x90", "--camera", "robot:5"]) == 0
    assert "warning: " in capsys.readouterr().err
    assert len(pictures(tmp_path / "cut.mp4")) == np.ceil(30 * ticks.time[-1] - 1e-9)


@pytest.mark.render
def test_a_model_that_does_not_compile_is_one_line_and_no_file(draws, monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(reader, "open_run", lambda path: run(model_xml="<mujoco><no/></mujoco>"))
    monkeypatch.chdir(tmp_path)
    Path("run.mcap").touch()
    assert main(["render", "run.mcap", "-o", "a.png", "--hide", "beams"]) == 2
    assert "the embedded model cannot be compiled" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["run.mcap"]


def test_scans_lie_on_the_wall_where_they_were_taken(log):
    made = open_run(log)
    scans = read_scans(log, 5)
    assert list(scans) == [4]
    scan = scans[4]
    np.testing.assert_allclose(np.diff(scan.time), 0.1)
    np.testing.assert_allclose(scan.angles, beam_angles(made.scenario.sensors.beams))
    pose = made.ticks.body_pose_true[np.round(scan.time / 0.01).astype(int)]
    x, y, heading = np.moveaxis(pose[:, 4], -1, 0)
    angle = heading[:, None] + scan.angles
    hit = np.stack([x[:, None] + scan.ranges * np.cos(angle), y[:, None] + scan.ranges * np.sin(angle)], axis=-1)
    # The wall's face, or another robot: within its radius of 0.06 m around its centre.
    face = np.abs(hit.sum(axis=-1) / np.sqrt(2) - (3 / np.sqrt(2) + 0.1))
    body = np.abs(np.linalg.norm(hit[:, :, None] - pose[:, None, :4, :2], axis=-1) - 0.06).min(axis=-1)
    known = np.isfinite(scan.ranges)
    assert known.sum() > 100
    assert (np.minimum(face, body)[known] < 0.05).mean() > 0.99


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["-o", "a.avi"], "'.avi'; allowed: .mp4, .webm, .gif, .webp, .png"),
        (["-o", "a.mp4", "--size", "321x180"], "needs even numbers"),
        (["-o", "a.mp4", "--size", "wide"], "the size is 'wide'"),
        (["-o", "a.mp4", "--at", "1"], "--at is for stills"),
        (["-o", "a.png", "--fps", "10"], "a still has one time"),
        (["-o", "a.png", "--camera", "robot:9"], "no camera 'robot:9'"),
        (["-o", "a.png", "--at", "99"], "the log has 0 to 10 s"),
        (["-o", "a.mp4", "--hide", "walls"], "no layer 'walls'"),
        (["-o", "nowhere/a.mp4", "--hide", "beams"], "nowhere/a.mp4: cannot write here"),
    ],
)
def test_wrong_arguments_are_one_line_and_no_file(arguments, says, monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(reader, "open_run", lambda path: run())
    monkeypatch.setattr(render, "working_backend", lambda: "egl")
    monkeypatch.chdir(tmp_path)
    Path("run.mcap").touch()
    assert main(["render", "run.mcap", *arguments]) == 2
    said = capsys.readouterr().err
    assert said.startswith("error: ") and said.count("\n") == 1 and says in said
    assert [path.name for path in tmp_path.iterdir()] == ["run.mcap"]


def test_without_gl_one_line_says_what_to_install(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(reader, "open_run", lambda path: run())
    monkeypatch.setattr(gl, "PROBE", "import sys; sys.exit('no library')")
    monkeypatch.chdir(tmp_path)
    Path("run.mcap").touch()
    assert main(["render", "run.mcap", "-o", "a.mp4", "--hide", "beams"]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "apt install libegl1 libgl1, or apt install libosmesa6" in said
    assert [path.name for path in tmp_path.iterdir()] == ["run.mcap"]
