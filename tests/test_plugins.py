"""Parts of an installed package, by name and with options of their own, and the same parts as objects."""

from __future__ import annotations

import sys
from textwrap import dedent

import numpy as np
import pytest

import pbrg_mj as pbrg
from pbrg_mj.cli.main import main
from pbrg_mj.errors import InputError, PlugInError
from pbrg_mj.loop.batch import BatchSimulation
from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.scenario.load import load_text, parse_scenario

CODE = """
from __future__ import annotations

from dataclasses import dataclass
from time import perf_counter

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator

from pbrg_mj.governor.centralized.clarabel_solver import ClarabelSolver
from pbrg_mj.governor.problem.ball import BallCertificate
from pbrg_mj.governor.problem.interface import Solution
from pbrg_mj.perception.half_spaces import HalfSpaces


class Options(BaseModel):
    model_config = ConfigDict(extra="forbid")
    gain: float = Field(gt=0, description="share of the way a tick [-]")
    point: tuple[float, float] = (0.0, 0.0)

    @model_validator(mode="after")
    def _far(self):
        if self.point[0] > 100:
            raise ValueError("a point nearer than 100 m")
        return self


@dataclass(frozen=True)
class Walker:
    gain: float

    def init(self, problem):
        return problem.p.mean(axis=0)

    def step(self, problem, memory):
        m = memory + self.gain * (problem.reference - memory)
        n = problem.network.robots
        return Solution(np.tile(m, (n, 1)), np.zeros_like(problem.rows.d), "ok", 0, np.zeros(n, dtype=np.int64)), m


def walker(scenario, options: Options):
    assert scenario.robots == 5
    return Walker(options.gain)


class MarginOptions(BaseModel):
    margin: float = 0.0


@dataclass(frozen=True)
class Shrunk:
    inner: BallCertificate
    margin: float

    def rows(self, half_spaces):
        rows = self.inner.rows(half_spaces)
        return rows._replace(d=rows.d - self.margin)


def shrunk(scenario, network, options: MarginOptions):
    return Shrunk(BallCertificate.of(scenario, network), options.margin)


@dataclass(frozen=True)
class Fence:
    robots: int
    slots: int
    reach: float

    def init(self):
        known = HalfSpaces.empty(self.robots, self.slots)
        known.G[0, 0], known.h[0, 0], known.active[0, 0], known.binds[0, 0] = (1.0, 0.0), self.reach, True, True
        return known

    def step(self, readings, time, memory):
        return memory, memory


class FenceOptions(BaseModel):
    reach: float


def fence(scenario, robot, options: FenceOptions):
    assert robot.clearance > 0
    return Fence(scenario.robots, scenario.estimator.half_spaces_per_robot, options.reach)


@dataclass(frozen=True)
class Biased:
    bias: float

    def scan(self, ranges, random):
        return np.where(ranges > 0, ranges + self.bias + 0.001 * random.standard_normal(len(ranges)), np.nan)

    def pose(self, pose, random):
        return pose + (self.bias, 0.0, 0.0)


class BiasOptions(BaseModel):
    bias: float


def biased(scenario, options: BiasOptions):
    return Biased(options.bias)


class Counting(ClarabelSolver):
    solved = 0

    def solve(self, problem):
        Counting.solved += 1
        return super().solve(problem)


def counting(scenario):
    return Counting()


class SpanOptions(BaseModel):
    scale: float = 1.0


def span(run, options: SpanOptions):
    return {"span_m": options.scale * float(np.ptp(run.q_true_m[..., 0]))}


def broken(scenario):
    raise OSError("no such licence")


def handless(scenario):
    return 3


def untyped(scenario, options):
    return 3
"""
GROUPS = {
    "governors": ("walker", "broken", "handless", "untyped"),
    "certificates": ("shrunk",),
    "estimators": ("fence",),
    "noise_models": ("biased",),
    "reference_solvers": ("counting",),
    "metrics": ("span", "broken"),
}
SCENARIO = """\
plant: ideal
timing: {duration: 0.3}
team:
  start: [[0, 0], [1, 0], [1, 1], [0, 1], [0.5, 0.5]]
  formation: [[0, 0], [1, 0], [1, 1], [0, 1], [0.5, 0.5]]
  leaders: [1]
graph: {kind: ring}
operator: {reference: [2, 1]}
estimator:
  source: given
  given: [{robot: 1, normal: [1, 0], offset: 1.8}]
"""


@pytest.fixture(autouse=True)
def installed(tmp_path, monkeypatch):
    """A package with a part for every group."""
    (tmp_path / "their_package.py").write_text(CODE)
    info = tmp_path / "their_package-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: their-package\nVersion: 1.0\n")
    lines = []
    for group, names in GROUPS.items():
        lines += [f"[pbrg_mj.{group}]", *(f"{name} = their_package:{name}" for name in names)]
    (info / "entry_points.txt").write_text("\n".join(lines) + "\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    yield
    sys.modules.pop("their_package", None)


def theirs():
    return sys.modules.get("their_package") or __import__("their_package")


def load(*overrides, text=SCENARIO):
    return load_text(text, "plan", overrides, file="plan.yaml").scenario


def records(*overrides):
    return list(Simulation.build(load(*overrides)).records())


def test_doctor_lists_parts_and_the_packages_that_offer_them(capsys, monkeypatch):
    monkeypatch.setattr("pbrg_mj.api.doctor.probe_gl", lambda _: {"works": True, "error": None, "packages": []})
    assert main(["doctor"]) == 0
    lines = capsys.readouterr().out.splitlines()
    kinds = next(line for line in lines if line.startswith("governor.kind "))
    assert kinds.split(None, 1)[1].startswith("distributed, certified, ") and "walker (their-package 1.0)" in kinds
    assert "counting (their-package 1.0)" in next(line for line in lines if line.startswith("reference.solver "))


def test_a_governor_with_options():
    found = records("governor.kind=walker", "governor.options={gain: 0.5}")
    m = np.array([record.solution.m[0] for record in found])
    np.testing.assert_allclose(m[1:], 0.5 * (m[:-1] + np.array((2.0, 1.0))), rtol=1e-12)


def test_a_certificate_with_options():
    plain, closer = records(), records("governor.certificate=shrunk", "governor.certificate_options.margin=0.25")
    np.testing.assert_array_equal(plain[0].problem.rows.d - 0.25, closer[0].problem.rows.d)
    assert closer[0].optimum.m[0] < plain[0].optimum.m[0] - 0.05


def test_an_estimator_with_options():
    found = records("estimator={source: fence, options: {reach: 1.5}}")
    assert found[0].half_spaces.h[0, 0] == 1.5
    assert all(record.half_spaces is found[0].half_spaces for record in found)  # copied once


def test_a_noise_model_with_options():
    """On the physics plant; beams and camera alike, seeded."""
    changes = ["sensors.noise_model=biased", "timing.duration=0.1", "sensors.camera.rate_hz=100"]
    runs = []
    for bias in (0.0, 0.0, 0.03):
        plan = pbrg.load("paper/experiment_near", [*changes, f"sensors.noise_options.bias={bias}"]).settings
        runs.append(list(Simulation.build(plan).records()))
    one, again, off = ([record.readings for record in run] for run in runs)
    for a, b in zip(one, again, strict=True):
        np.testing.assert_array_equal(a.ranges, b.ranges)
    first = next(k for k, reading in enumerate(one) if reading.new_scan)
    seen = ~np.isnan(one[first].ranges) & ~np.isnan(off[first].ranges)
    assert seen.any()
    np.testing.assert_allclose((off[first].ranges - one[first].ranges)[seen], 0.03, atol=1e-12)
    np.testing.assert_allclose(one[-1].body_pose, runs[0][-1].truth.body_pose, atol=1e-3)


def test_a_reference_solver():
    before = theirs().Counting.solved
    found = records("reference.solver=counting")
    assert theirs().Counting.solved - before == sum(record.optimum is not None for record in found) > 0


def test_a_metric_by_name_and_as_a_function(capsys, tmp_path):
    run = pbrg.run(pbrg.load("paper/simulation_near", duration=0.2), log=tmp_path / "short.mcap")
    span = float(np.ptp(run.q_true_m[..., 0]))
    assert run.metric("span") == {"span_m": span}
    assert run.metric("span", scale=2.0) == {"span_m": 2.0 * span}

    def ticks(run):
        return len(run.time_s)

    assert run.metric(ticks) == {"ticks": 21.0}
    compared = pbrg.compare(run, run, metrics=["span", ticks])
    assert [one["own"] for one in compared.as_dicts()] == 2 * [{"span_m": span, "ticks": 21.0}]
    assert "own metrics" in compared.table()
    assert "own" not in pbrg.compare(run).as_dicts()[0]
    assert main(["compare", str(run.path), "--metric", "span"]) == 0
    assert "span_m" in capsys.readouterr().out
    assert main(["compare", str(run.path), "--metric", "broken"]) == 1
    assert capsys.readouterr().err == "error: broken: the metric raised OSError in its function: no such licence\n"
    with pytest.raises(InputError, match=r"no metric is called 'fancy'; allowed: broken, span"):
        run.metric("fancy")
    with pytest.raises(PlugInError, match="text: the metric returned 'text': 'far'"):
        run.metric(text)


def text(run):
    return "far"


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ("kind: fancy", "10: governor.kind: no governor is called 'fancy'; allowed: distributed, certified, "),
        ("kind: walker", "9: governor.options.gain: is missing; required: a number greater than 0 (share of the way"),
        (
            "kind: walker\n  options:\n    gain: -1",
            "12: governor.options.gain: is -1; allowed: a number greater than 0",
        ),
        ("kind: walker\n  options:\n    gain: '1'", "12: governor.options.gain: is '1'; allowed: a number greater"),
        (
            "kind: walker\n  options:\n    gain: 1\n    gian: 2",
            "13: governor.options.gian: is unknown; did you mean `gain`?",
        ),
        (
            "kind: walker\n  options:\n    gain: 1\n    point: [200, 0]",
            "11: governor.options: is wrong; allowed: a point nearer than 100 m",
        ),
        (
            "kind: walker\n  options:\n    gain: 1\n    point: [2, x]",
            "13: governor.options.point.1: is 'x'; allowed: Input should be a valid number",
        ),
        (
            "certificate: shrunk\n  certificate_options:\n    margn: 2",
            "12: governor.certificate_options.margn: is unknown; did you mean `margin`?",
        ),
        ("options: {gain: 1}", "10: governor.options: is {gain: 1}; allowed: nothing, for the governor distributed"),
    ],
)
def test_what_is_wrong_has_file_line_and_key(lines, message):
    text = dedent(SCENARIO).replace("estimator:", f"governor:\n  {lines}\nestimator:")
    with pytest.raises(InputError) as refused:
        load(text=text)
    assert str(refused.value).startswith(f"plan.yaml:{message}"), str(refused.value)


def test_an_override_is_named():
    with pytest.raises(InputError, match=r"governor.options.gain: is 0; allowed: .*; set by override"):
        load("governor.kind=walker", "governor.options.gain=0")


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("broken", "broken: the governor raised OSError in build: no such licence"),
        ("handless", "handless: the governor has no method init or step: 3"),
    ],
)
def test_a_part_that_cannot_be_built_is_named(name, message):
    with pytest.raises(PlugInError) as refused:
        records(f"governor.kind={name}")
    assert str(refused.value) == message


def test_options_without_a_model_are_refused():
    with pytest.raises(PlugInError, match=r"the parameter `options` of .*untyped.* is not annotated"):
        load("governor.kind=untyped")


def test_a_log_opens_without_the_package_that_made_it():
    parse_scenario(SCENARIO + "governor: {kind: of_another_machine, options: {gain: 3}}\n")


def test_objects_take_the_place_of_names():
    parts = theirs()
    plan = pbrg.load("paper/simulation_near", duration=0.2)
    network_of = Simulation.build(plan.settings).loop.network
    objects = {
        "governor": parts.Walker(0.1),
        "certificate": parts.Shrunk(parts.BallCertificate.of(plan.settings, network_of), 0.5),
        "estimator": parts.Fence(5, 4, 1.5),
        "reference_solver": parts.Counting(),
    }
    run = pbrg.run(plan, **objects)
    assert run.scenario.settings.governor.kind == "object:Walker"
    assert run.scenario.settings.estimator.source == "object:Fence"
    assert pbrg.verify(run, **objects).verdict == "identical"
    with pytest.raises(InputError, match=r"the certificate was an object of the class Shrunk .* as `certificate`"):
        pbrg.verify(run, **(objects | {"certificate": None}))
    with pytest.raises(InputError, match="3 is no estimator; allowed: an object with the methods init and step"):
        pbrg.run(plan, estimator=3)


class Wrong:
    """Parts that answer what nobody can use."""

    def __init__(self, answer):
        self.answer = answer

    def init(self, *_):
        return None

    def step(self, *_):
        return self.answer, None

    def rows(self, half_spaces):
        return self.answer

    def solve(self, problem):
        return self.answer


@pytest.mark.parametrize(
    ("part", "answer", "message"),
    [
        ("governor", 3, "Wrong: the governor's step returned int and memory, not Solution and memory"),
        ("certificate", 3, "Wrong: the certificate's rows are int, not Rows"),
        ("estimator", 3, "Wrong: the estimator's step returned int and memory, not HalfSpaces and memory"),
        ("reference_solver", 3, "Wrong: the reference solver's solve returned int, not Optimum"),
    ],
)
def test_answers_of_another_kind_are_named(part, answer, message):
    plan = pbrg.load("paper/simulation_near", duration=0.1)
    with pytest.raises(PlugInError, match=message):
        list(pbrg.simulate(plan, **{part: Wrong(answer)}))


def test_worlds_side_by_side_refuse_plug_ins():
    plan = pbrg.load("paper/experiment_near", ["governor.certificate=shrunk"], duration=0.1)
    with pytest.raises(InputError, match=r"governor.certificate: worlds side by side have no certificate of a plug-in"):
        BatchSimulation(plan.settings, (1, 2))
