"""`pbrg run --profile`: stages add up to the whole, and nothing but the timings differs."""

import json

import pytest

from pbrg_mj.api import profile as module
from pbrg_mj.api.profile import Profile
from pbrg_mj.cli.main import main
from tests.records import records


def test_stages_and_timed_sinks_add_up_and_the_rest_is_other(monkeypatch):
    clock = iter([10.0, 11.0, 20.0, 100.0, 103.0, 200.0])  # of sink, sink, tick; the first tick is set-up
    monkeypatch.setattr(module, "clock", lambda: next(clock))
    profile, seen = Profile(), []
    sink = profile.timed("log", seen.append)
    ticks = records(2)
    for record in ticks:
        sink(record)
        profile(record)
    assert seen == ticks
    spent, timings = profile.per_tick(), ticks[1].timings._asdict()
    assert spent["log"] == pytest.approx(3e6)
    assert {name: spent[name] for name in timings} == pytest.approx({k: 1e6 * v for k, v in timings.items()})
    assert spent["total"] == pytest.approx((200.0 - 20.0) * 1e6)
    assert spent["other"] == pytest.approx(spent["total"] - 3e6 - 1e6 * sum(timings.values()))
    assert "100.0" in profile.table().splitlines()[-1]


def test_the_command_prints_it_with_and_without_json(tmp_path, capsys):
    run = [
        "run",
        "paper/simulation_near",
        "--duration",
        "0.5",
        "-o",
        str(tmp_path / "run.mcap"),
        "--force",
        "--profile",
    ]
    assert main(run) == 0
    shares = [float(line.split()[-1]) for line in capsys.readouterr().out.split("us/tick")[1].splitlines()[1:]]
    assert sum(shares[:-1]) == pytest.approx(100.0, abs=1.0)
    assert main([*run, "--json"]) == 0
    stages = json.loads(capsys.readouterr().out)["profile_us_per_tick"]
    assert list(stages)[-2:] == ["other", "total"]
    assert all(spent >= 0 for spent in stages.values())
    assert main([*run[:-1], "--json"]) == 0
    assert "profile_us_per_tick" not in json.loads(capsys.readouterr().out)
