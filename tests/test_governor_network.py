"""Delay and loss of messages: against the rounds written out, and against what a robot may know and when."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from pbrg_mj.governor.distributed.estimates import Estimates, Flow
from pbrg_mj.governor.distributed.governor import DistributedGovernor
from pbrg_mj.governor.distributed.rounds import run_rounds
from pbrg_mj.scenario.load import parse_scenario
from pbrg_mj.team.channel import NEVER, Loss
from pbrg_mj.team.channel import channel as channel_of
from tests.channels import channel, links, lonely, naive, quiet, run, scheduled, uneven
from tests.problems import GRAPHS, graph, random_problem
from tests.scenario_texts import three
from tests.test_governor_rounds import FLOW, PRIVATE, random_estimates

FIELDS = Estimates._fields
SOME_LOSS = {"none": Loss(), "independent": Loss.independent(0.3), "bursty": Loss.bursty(0.3, 4.0)}


JITTER, QUEUE = {"jitter": 5}, {"jitter": 5, "in_order": True}
WAYS = [*((name, {}) for name in GRAPHS), ("kite", JITTER), ("kite", QUEUE), ("kite", {"jitter": 3, "reserve": 6})]


def start(seed, name="kite"):
    rng = np.random.default_rng(seed)
    problem = random_problem(rng, graph(GRAPHS[name], leaders=(1, 4)))
    return problem, random_estimates(rng, problem.rows)


@pytest.mark.parametrize("impedance", [0.0, 0.7, 2.0])
@pytest.mark.parametrize("loss", SOME_LOSS)
@pytest.mark.parametrize(("name", "how"), WAYS)
def test_rounds_are_the_rounds_written_out(name, how, loss, impedance):
    problem, first = start(4, name)
    delay = uneven if impedance else lambda i, k: uneven(i, k) - 1
    links_ = channel(problem.network, delay, impedance, SOME_LOSS[loss], seed=9, **how)
    got, _ = run(problem, quiet(links_, first), links_, FLOW, 40)
    want = naive(problem, first, links_, FLOW, 40)
    for field in FIELDS:
        np.testing.assert_allclose(getattr(got, field), getattr(want, field), atol=1e-11, rtol=0)


@pytest.mark.parametrize("name", GRAPHS)
def test_without_delay_and_loss_it_is_the_immediate_exchange_bit_for_bit(name):
    problem, first = start(5, name)
    links_ = channel(problem.network)
    got, _ = run(problem, quiet(links_, first), links_, FLOW, 300)
    want = run_rounds(problem, first, FLOW, 300)
    for field in FIELDS:
        np.testing.assert_array_equal(getattr(got, field), getattr(want, field))


@pytest.mark.parametrize("impedance", [0.0, 2.0])
def test_rounds_may_be_grouped_in_any_way_and_leave_their_memory_alone(impedance):
    problem, first = start(6)
    links_ = channel(
        problem.network, uneven, impedance, Loss.bursty(0.4, 3.0), outage_rounds=[(2, 20, 35)], silent_after=5
    )
    at_once = memory = quiet(links_, first)
    before = at_once[1].copied()
    at_once = run(problem, at_once, links_, FLOW, 60)
    for rounds in (1, 2, 30, 0, 27):
        memory = run(problem, memory, links_, FLOW, rounds)
    for whole, parts in zip(at_once[0], memory[0], strict=True):
        np.testing.assert_array_equal(whole, parts)
    for field in dataclasses.fields(before):
        np.testing.assert_array_equal(getattr(at_once[1], field.name), getattr(memory[1], field.name))
    untouched = quiet(links_, first)[1]
    for field in dataclasses.fields(before):
        np.testing.assert_array_equal(getattr(before, field.name), getattr(untouched, field.name))


def test_when_all_is_lost_everyone_is_alone():
    problem, first = start(7)
    links_ = channel(problem.network, loss=Loss.independent(1.0))
    got, _ = run(problem, quiet(links_, first), links_, FLOW, 50)
    want = run_rounds(dataclasses.replace(problem, network=lonely(problem.network)), first, FLOW, 50)
    for field in FIELDS:
        np.testing.assert_array_equal(getattr(got, field), getattr(want, field))


@pytest.mark.parametrize("loss", [Loss.independent(0.2), Loss.bursty(0.2, 7.0), Loss.bursty(0.6, 2.0)])
def test_losses_have_the_stated_share_and_runs(loss):
    rounds = 100_000
    links_ = channel(graph(), loss=loss)
    bad = links_.lost(np.zeros(10, dtype=bool), 0, rounds)
    runs = np.count_nonzero(bad[1:] & ~bad[:-1], axis=0)
    np.testing.assert_allclose(bad.mean(), loss.share, rtol=0.02)
    np.testing.assert_allclose(bad.sum() / runs.sum(), 1.0 / (1.0 - loss.stay), rtol=0.02)
    together = np.cov(bad.T.astype(float)) / (loss.share * (1 - loss.share))
    np.testing.assert_allclose(
        together - np.diag(np.diag(together)), 0.0, atol=0.06
    )  # links know nothing of each other


@pytest.mark.parametrize("first", [0, 1, 64])
def test_no_rounds_lose_and_delay_nothing(first):
    """A governor whose estimates have diverged runs no rounds, perhaps from its first tick on."""
    links_ = channel(graph(), loss=Loss.bursty(0.2, 7.0), jitter=2)
    nothing = np.zeros(10, dtype=np.int64)
    assert links_.lost(nothing.astype(bool), first, 0).shape == (0, 10)
    assert links_.arrivals(nothing, first, 0).shape == (0, 10)


def test_another_seed_loses_other_messages_and_the_same_seed_the_same():
    one, same, other = (channel(graph(), loss=Loss.independent(0.5), seed=s) for s in (1, 1, 2))
    nothing = np.zeros(10, dtype=bool)
    np.testing.assert_array_equal(one.lost(nothing, 0, 64), same.lost(nothing, 0, 64))
    assert 200 < np.count_nonzero(one.lost(nothing, 0, 64) != other.lost(nothing, 0, 64)) < 440


def test_jitter_is_even_and_its_own_and_a_queue_keeps_the_order():
    rounds = 20_000
    free, queue, other = (
        channel(graph(), uneven, jitter=4, in_order=order, seed=seed)
        for order, seed in ((False, 1), (True, 1), (False, 2))
    )
    nothing = np.zeros(10, dtype=np.int64)
    arrivals, sent = free.arrivals(nothing, 0, rounds), np.arange(rounds)[:, None]
    extra = arrivals - sent - free.delay
    counts = np.array([np.bincount(link, minlength=5) for link in extra.T])
    np.testing.assert_allclose(counts / rounds, 0.2, atol=0.015)
    assert np.any(np.diff(arrivals, axis=0) < 0, axis=0).all()
    assert np.mean(arrivals == other.arrivals(nothing, 0, rounds)) == pytest.approx(0.2, abs=0.01)
    in_order = queue.arrivals(nothing, 0, rounds)
    np.testing.assert_array_equal(in_order, np.maximum.accumulate(arrivals))
    for one in (free, queue):  # whatever rounds are asked for at once
        parts = [one.arrivals(nothing, 0, 7)]
        parts.append(one.arrivals(parts[0][-1], 7, 30))
        np.testing.assert_array_equal(np.vstack(parts), one.arrivals(nothing, 0, 37))


def test_a_message_that_comes_after_a_newer_one_is_dropped():
    """Of five messages sent in rounds 0 to 4, those of rounds 1 and 2 are overtaken by that of round 3."""
    problem, first = start(7, "path")
    extra = np.zeros((8, 8), dtype=np.int64)
    extra[:5] = np.array([0, 4, 4, 0, 2])[:, None]
    links_ = scheduled(channel(problem.network, 1), np.zeros((8, 8), dtype=bool), extra)
    memory, newest = quiet(links_, first), []
    for _ in range(8):
        memory = run(problem, memory, links_, FLOW, 1)
        states = memory[1]
        newest.append((states.round - states.age)[0] if states.up[0] else None)
    # held after rounds 0 to 7, by the round of sending; those of round 5 and later are in time
    assert newest == [None, 0, 0, 0, 3, 3, 5, 6]


def test_estimates_that_come_out_of_order_are_those_sent_last():
    problem, first = start(8)
    links_ = channel(problem.network, uneven, jitter=6, seed=4)
    memory, sent = quiet(links_, first), []
    receiver, sender = np.array(links(problem.network)).T
    for _ in range(60):
        sent.append(np.stack([memory[0].z[sender], memory[0].zeta[sender]]))
        memory = run(problem, memory, links_, FLOW, 1)
        states = memory[1]
        for e in np.flatnonzero(states.up):
            np.testing.assert_array_equal(states.held[:, e], sent[states.round - states.age[e]][:, e])
    assert len(receiver) == len(links_.delay)


def travel_times(network, delays):
    """Rounds that anything needs from robot to robot: a hop takes its delay and the round that uses it."""
    n = network.robots
    times = np.where(np.eye(n, dtype=bool), 0, 10**6)
    for (i, k), delay in zip(links(network), delays, strict=True):
        times[i, k] = delay + 1
    for via in range(n):
        times = np.minimum(times, times[:, via, None] + times[None, via])
    return times


@pytest.mark.parametrize("private", PRIVATE)
@pytest.mark.parametrize(("name", "impedance"), [("ring", 0.0), ("kite", 0.0), ("path", 2.0), ("kite", 2.0)])
def test_private_data_travel_no_faster_than_the_links(name, impedance, private):
    """Bit-identical for as many rounds as the links need; two rounds later it has arrived."""
    network = graph(GRAPHS[name])
    rng = np.random.default_rng(7)
    problem = random_problem(rng, network)
    problem = dataclasses.replace(problem, rows=problem.rows._replace(active=np.ones_like(problem.rows.active)))
    first = random_estimates(rng, problem.rows)
    first = first._replace(lam=np.full_like(first.lam, 0.5))
    links_ = channel(network, uneven, impedance, outage_rounds=[(2, 0, 3)], silent_after=40)
    times = travel_times(network, links_.delay)
    for k in (0, 3, 4):
        memories = [quiet(links_, first), quiet(links_, first)]
        problems = [problem, PRIVATE[private](problem, k)]
        for rounds in range(1, 1 + times.max() + 2):
            memories = [run(p, memory, links_, FLOW, 1) for p, memory in zip(problems, memories, strict=True)]
            (same, _), (changed, _) = memories
            for i in range(5):
                equal = all(np.array_equal(getattr(same, f)[i], getattr(changed, f)[i]) for f in FIELDS)
                if rounds <= times[i, k]:
                    assert equal, (i, k, rounds)
                if rounds >= times[i, k] + 4:  # robot 3 is silent in the first three rounds
                    assert not equal, (i, k, rounds)


def test_bytes_count_what_is_sent_though_it_be_lost_and_nothing_of_the_silent():
    problem, _ = start(8)
    for impedance in (0.0, 2.0):
        message = 2 * 22 * 8 + 2 + (4 if impedance else 0)  # vectors, hop count, and how many waves are in the sum
        links_ = channel(problem.network, 1, impedance, Loss.independent(0.5), outage_rounds=[(2, 4, 7)])
        governor = DistributedGovernor(Flow(2.0, 1e-3), 10, "zero", links_)
        solution, memory = governor.step(problem, governor.init(problem))
        np.testing.assert_array_equal(solution.bytes_sent, message * np.array([20, 20, 3 * 7, 20, 10]))
        solution, _ = governor.step(problem, memory)
        np.testing.assert_array_equal(solution.bytes_sent, message * 10 * np.array([2, 2, 3, 2, 1]))


def test_messages_that_may_be_overtaken_carry_a_number():
    problem, _ = start(8)
    links_ = channel(problem.network, 1, jitter=3)
    governor = DistributedGovernor(Flow(2.0, 1e-3), 10, "zero", links_)
    solution, _ = governor.step(problem, governor.init(problem))
    np.testing.assert_array_equal(solution.bytes_sent, (2 * 22 * 8 + 2 + 4) * 10 * problem.network.degree)


NETWORK = """{exchange: scattering, impedance: 3, delay_rounds: 4, links: [{robots: [3, 2], delay_rounds: 9}],
  loss: 0.2, loss_burst: 4, neighbour_timeout: 0.3,
  outages: [{robot: 2, time: 1.5, duration: 0.25}, {robot: 1, time: 7}]}"""


def test_a_scenarios_network_becomes_rounds():
    scenario = parse_scenario(three(graph="{kind: path}", governor="{rounds: 4}", network=NETWORK))
    made = channel_of(scenario)
    assert made is not None
    np.testing.assert_array_equal(made.delay, [4, 4, 9, 9])  # 1<-2, 2<-1, 2<-3, 3<-2
    assert (made.impedance, made.seed, made.silent_after) == (3.0, 3, 120)  # 4 rounds every 10 ms
    assert made.loss == Loss(0.2, pytest.approx(0.0625), 0.75)
    np.testing.assert_array_equal(made.outage_rounds, [[1, 600, 700], [0, 2800, NEVER]])
    assert (made.jitter, made.in_order, made.reserve) == (0, False, 19)  # 0.2 * 0.75^19 < 0.001 < 0.2 * 0.75^18
    assert made.silent(2798, 4, 3).tolist() == [[False] * 3] * 2 + [[True, False, False]] * 2


@pytest.mark.parametrize(
    ("section", "reserve"),
    [
        ("{delay_rounds: 3}", 0),
        ("{jitter_rounds: 7, reordering: false}", 7),
        ("{jitter_rounds: 7, loss: 0.5}", 7 + 9),  # 2^-10 < 0.001 < 2^-9
        ("{jitter_rounds: 7, loss: 0.5, reserve_rounds: 3}", 3),
        ("{loss: 0.5, loss_burst: 1000}", 2000),  # no longer than neighbour_timeout: beyond, the robots hold
        ("{loss: 0.5, loss_burst: 1}", 1),
        ("{loss: 1}", 0),
    ],
)
def test_the_reserve_is_what_links_use_up_in_one_of_a_thousand_rounds(section, reserve):
    made = channel_of(parse_scenario(three(graph="{kind: path}", governor="{rounds: 40}", network=section)))
    assert made is not None
    assert made.reserve == reserve
    assert made.in_order == ("reordering" in section)


def test_a_scenario_that_says_nothing_has_the_immediate_exchange():
    assert channel_of(parse_scenario(three(network="{neighbour_timeout: 2, impedance: 5}"))) is None
    for one in ("{delay_rounds: 1}", "{jitter_rounds: 2}", "{loss: 0.1}", "{outages: [{robot: 1, time: 0}]}"):
        assert channel_of(parse_scenario(three(network=one))) is not None
