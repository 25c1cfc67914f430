"""The report in a browser: real clicks move robots to where the log says, and nothing reaches for the network."""

from __future__ import annotations

import re

import numpy as np
import pytest

from pbrg_mj.analysis.report.page import page
from pbrg_mj.analysis.report.report_run import report_run
from pbrg_mj.cli.main import main
from pbrg_mj.log.read.run import open_run
from pbrg_mj.log.write.writer import LogWriter
from tests.browser import PROGRAM, Browser
from tests.needs import need
from tests.records import loaded, records
from tests.runs import resting, run, walled
from tests.test_report_page import hostile

pytestmark = pytest.mark.browser
PIXEL = 1.0


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    need(PROGRAM, "Chromium; on Debian and Ubuntu: apt-get install chromium")
    with Browser(tmp_path_factory.mktemp("browser")) as started:
        yield started


@pytest.fixture
def opened(browser, tmp_path):
    """A function that opens a page of runs; afterwards nothing was asked for but the file, and nothing complained."""

    def open_page(*runs):
        return show(page([report_run(one, len(runs)) for one in runs]))

    def show(text):
        file = tmp_path / "report.html"
        file.write_text(text, encoding="utf-8")
        browser.size(1280, 900)
        browser.events.clear()
        print(f"loaded and drawn in {browser.open(file):.2f} s, {len(text.encode()) / 1e6:.2f} MB")
        return browser

    open_page.show = show
    yield open_page
    assert browser.requests() == [(tmp_path / "report.html").as_uri()]
    assert browser.complaints() == []
    assert not [event for event in browser.events if event["method"] == "Page.javascriptDialogOpening"]


def circling():
    """Two robots on circles about the origin, references and a wall's half-space that move, over 20 s."""
    plan = walled()
    turn = np.linspace(0.0, 2 * np.pi, 21)
    circle = np.column_stack([np.cos(turn), np.sin(turn)])
    hand = np.stack([circle, -0.5 * circle], axis=1)
    pose = np.concatenate([hand - 0.04 * np.array([1.0, 0.0]), np.zeros((21, 2, 1))], axis=2)
    h = resting(plan).half_space_h.copy()
    h[:, 0, 0] = np.linspace(1.0, 2.0, 21)
    ticks = {"hand_true": hand, "body_pose_true": pose, "m": 0.8 * hand, "half_space_h": h}
    return run(plan, ticks=ticks)


def middle(browser, selector):
    left, top, width, height = browser.box(selector)
    return np.array([left + width / 2, top + height / 2])


def to_pixels(browser, scene):
    """Return the map from metres to pixels as the scene's own grid lines and labels draw it."""

    def axis(name, of):
        script = f"[...document.querySelectorAll('#scenes figure:nth-child({scene}) line[data-{name}]')]"
        pairs = browser.evaluate(f"{script}.map((e) => [+e.dataset.{name}, e.getBoundingClientRect().{of}])")
        assert len(pairs) >= 2
        return np.polyfit(*np.array(pairs).T, 1)

    x, y = axis("x", "left"), axis("y", "top")
    return lambda point: np.array([np.polyval(x, point[0]), np.polyval(y, point[1])])


def shown_time(browser):
    return float(re.match(r"([\d.]+) s of", browser.evaluate("document.querySelector('#clock').textContent"))[1])


def assert_drawn_as_logged(browser, seen, scene=1):
    tick = np.searchsorted(seen.ticks.time, shown_time(browser) + 1e-3, side="right") - 1
    pixels = to_pixels(browser, scene)
    for robot in range(seen.ticks.m.shape[1]):
        of_robot = f'#scenes figure:nth-child({scene}) [data-robot="{robot + 1}"]'
        drawn = middle(browser, f"{of_robot} .dot")
        np.testing.assert_allclose(drawn, pixels(seen.ticks.hand_true[tick, robot]), atol=PIXEL)
        drawn = middle(browser, f"{of_robot}.m")
        np.testing.assert_allclose(drawn, pixels(seen.ticks.m[tick, robot]), atol=PIXEL)
    return tick


def test_a_click_on_the_slider_moves_robots_references_and_half_spaces_to_that_time(opened):
    seen = circling()
    browser = opened(seen)
    assert assert_drawn_as_logged(browser, seen) == 0
    for across in (0.3, 0.8, 0.55):
        browser.click("#time", across=across)
        tick = assert_drawn_as_logged(browser, seen)
        assert abs(tick - 20 * across) <= 1
        left, _, width, _ = browser.box(".half-space .sensed")
        x = to_pixels(browser, 1)((seen.ticks.half_space_h[tick, 0, 0], 0.0))[0]
        assert left + width / 2 == pytest.approx(x, abs=2 * PIXEL)


def test_the_play_button_moves_robots_and_stops_them(opened):
    seen = circling()
    browser = opened(seen)
    before = middle(browser, '[data-robot="1"] .dot')
    browser.click("#play")
    browser.until("parseFloat(document.querySelector('#clock').textContent) > 2")
    browser.click("#play")
    stopped = shown_time(browser)
    assert 2 < stopped < 10
    assert_drawn_as_logged(browser, seen)
    assert np.linalg.norm(middle(browser, '[data-robot="1"] .dot') - before) > 20
    browser.evaluate("new Promise((done) => setTimeout(done, 200))")
    assert shown_time(browser) == stopped


def test_play_ends_at_the_end_and_begins_anew(opened):
    browser = opened(circling())
    browser.press("End", code=35)
    assert shown_time(browser) == 10
    browser.click("#play")
    browser.until("parseFloat(document.querySelector('#clock').textContent) < 5")
    browser.until("document.querySelector('#play').textContent === 'Play'")
    assert shown_time(browser) == 10


def test_keys_play_and_step(opened):
    browser = opened(circling())
    for key, code, shift, time in (
        ("ArrowRight", 39, False, 0.5),
        ("ArrowRight", 39, True, 5.5),
        ("ArrowLeft", 37, False, 5.0),
        ("End", 35, False, 10.0),
        ("Home", 36, False, 0.0),
    ):
        browser.press(key, code=code, shift=shift)
        assert shown_time(browser) == time
    browser.click("#time", across=0.5)  # the slider has the focus now
    browser.press("ArrowRight", code=39)
    assert shown_time(browser) == 5.5
    browser.press(" ", code=32)
    browser.until("document.querySelector('#play').textContent === 'Pause'")
    browser.press(" ", code=32)
    browser.until("document.querySelector('#play').textContent === 'Play'")


def test_a_box_that_moves_and_the_optimum_move_too(opened):
    stops = ({"time": 2.0, "center": (0.0, 1.0)}, {"time": 8.0, "center": (1.5, 1.0)})
    plan = walled()
    world = plan.world.model_validate(
        {"walls": plan.world.walls, "moving_boxes": ({"size": (0.4, 0.2), "waypoints": stops},)}
    )
    seen = circling()
    optima = seen.optima
    optima.m[:, 0] = np.linspace(0.0, 1.0, len(optima.index))
    browser = opened(run(plan.model_copy(update={"world": world}), ticks=vars(seen.ticks), optima=optima))
    for keys, x, star in ((0, 0.0, 0.0), (1, 0.75, 0.4), (2, 1.5, 1.0)):
        browser.press("Home", code=36)
        for _ in range(keys):
            browser.press("ArrowRight", code=39, shift=True)
        pixels = to_pixels(browser, 1)
        np.testing.assert_allclose(middle(browser, "#scenes .mover"), pixels((x, 1.0)), atol=PIXEL)
        np.testing.assert_allclose(middle(browser, "#scenes .mstar"), pixels((star, 0.0)), atol=PIXEL)


def test_several_runs_move_together_each_by_its_own_clock(opened):
    seen = circling()
    short = {name: value[:11] for name, value in vars(seen.ticks).items()}
    browser = opened(seen, run(seen.scenario, ticks=short))
    browser.click("#time", across=0.8)
    assert assert_drawn_as_logged(browser, seen, 1) == pytest.approx(16, abs=1)
    assert assert_drawn_as_logged(browser, run(seen.scenario, ticks=short), 2) == 10  # at its end


def test_a_click_on_a_figure_goes_there_and_a_drag_zooms(opened):
    seen = circling()
    browser = opened(seen)
    browser.click(".chart svg", across=0.5)
    assert shown_time(browser) == pytest.approx(5.0, abs=0.6)
    assert_drawn_as_logged(browser, seen)
    labels = "[...document.querySelectorAll('.chart:first-child .grid-lines text')].map((e) => e.textContent)"
    assert "0 s" in browser.evaluate(labels)
    browser.drag(".chart svg", 0.4, 0.9)
    assert "0 s" not in browser.evaluate(labels)
    browser.click("#whole")
    assert "0 s" in browser.evaluate(labels)


def test_a_chosen_robot_stands_out(opened):
    browser = opened(circling())
    browser.click("#robots button:nth-of-type(2)")
    dim = "[...document.querySelectorAll('#scenes .robot')].map((e) => e.classList.contains('dim'))"
    assert browser.evaluate(dim) == [True, False]
    browser.click("#robots button:nth-of-type(2)")
    assert browser.evaluate(dim) == [False, False]


def test_an_event_leads_to_its_moment(opened):
    seen = circling()
    touch = np.zeros((21, 2), dtype=bool)
    touch[14, 0] = True
    browser = opened(run(seen.scenario, ticks=vars(seen.ticks) | {"wall_contact": touch}))
    browser.click(".events button")
    assert shown_time(browser) == 7.0


def test_a_hostile_log_is_shown_as_text(opened):
    browser = opened(hostile())
    assert "<script>alert(1)" in browser.evaluate("document.querySelector('.events').textContent")
    assert browser.evaluate("document.images.length") == 0


def test_nothing_from_outside_runs_even_if_it_were_let_in(browser, tmp_path):
    """The policy alone, with the escaping left out: neither the script nor the image may come to life."""
    let_in = "<script>window.broken = 1</script><img src='http://127.0.0.1:9/x' onerror='window.broken = 2'>"
    file = tmp_path / "report.html"
    file.write_text(page([report_run(run(), 1)]).replace("<main>", f"<main>{let_in}"), encoding="utf-8")
    browser.events.clear()
    browser.open(file)
    assert browser.evaluate("window.broken ?? null") is None
    blocked = str(browser.complaints())
    assert "inline script" in blocked
    assert "127.0.0.1:9" in blocked
    assert not [e for e in browser.events if e["method"] == "Network.responseReceived" and ":9/" in str(e)]


@pytest.mark.parametrize("width", [1280, 390])
def test_the_page_fits_the_window(opened, width):
    browser = opened(circling(), circling())
    browser.size(width, 800)
    browser.until(f"document.querySelector('#scenes').clientWidth < {width}")
    browser.evaluate("new Promise((done) => requestAnimationFrame(() => setTimeout(done, 50)))")
    assert browser.evaluate("document.documentElement.scrollWidth") == width
    browser.click("#time", across=0.5)
    assert_drawn_as_logged(browser, circling(), 2)


def test_from_a_log_through_the_command_to_the_screen(opened, tmp_path):
    log, out = tmp_path / "three.mcap", tmp_path / "out.html"
    with LogWriter(log, loaded(timings=True), "<mujoco/>") as sink:
        for record in records(80):
            sink(record)
    assert main(["report", str(log), "-o", str(out)]) == 0
    browser = opened.show(out.read_text(encoding="utf-8"))
    for across in (0.9, 0.4):
        browser.click("#time", across=across)
        assert_drawn_as_logged(browser, open_run(log))
