"""What certificates say of an applied reference, against brute force, theorems and an adversary's search."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.linalg import expm

import pbrg_mj as pbrg
from pbrg_mj.analysis.metrics.table import comparison_table
from pbrg_mj.governor.certificate.directional_ball import DirectionalBall
from pbrg_mj.governor.certificate.evaluate import NAMES, rows_of_model, worst_rows
from pbrg_mj.governor.certificate.prediction_grid import PredictionGrid
from pbrg_mj.governor.certificate.predictive import PredictiveCertificate
from pbrg_mj.governor.certificate.team_model import TeamModel
from pbrg_mj.governor.problem.rows import rho, rho_along
from pbrg_mj.log.schema import channels
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.scenario.schema import Control
from pbrg_mj.team.graph import network_of_edges
from pbrg_mj.team.sampled import continuous_map


def random_team(rng: np.random.Generator, most: int = 6) -> tuple[TeamModel, np.ndarray]:
    """Return a connected team with random gains and tick, and its A_c."""
    n = int(rng.integers(1, most + 1))
    edges = [(i, int(rng.integers(i))) for i in range(1, n)]
    edges += [(i, k) for i in range(n) for k in range(i) if (i, k) not in edges and rng.random() < 0.3]
    leader = np.zeros(n)
    leader[rng.permutation(n)[: int(rng.integers(1, n + 1))]] = 1.0
    team = network_of_edges(edges, leader)
    control = Control(alpha_r=rng.uniform(0.5, 4.0), leak=rng.choice([0.0, 0.2]))
    return TeamModel.of(team, control, float(rng.choice([0.005, 0.01, 0.02]))), continuous_map(team, control)


def random_states(rng: np.random.Generator, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    p, xi = rng.normal(size=(n, 2)), 0.3 * rng.normal(size=(n, 2))
    return p, xi - xi.mean(axis=0), rng.normal(size=2)


def unit(rng: np.random.Generator) -> np.ndarray:
    angle = rng.uniform(0, 2 * np.pi)
    return np.array([np.cos(angle), np.sin(angle)])


def half_space(G: np.ndarray, h: float, binds: np.ndarray) -> HalfSpaces:
    """One half-space, of the first robot."""
    spaces = HalfSpaces.empty(len(binds), 1)
    spaces.G[0, 0], spaces.h[0, 0], spaces.active[0, 0], spaces.binds[0, 0] = G, h, True, binds
    return spaces


def at_one_tick(spaces: HalfSpaces, p, xi, m, formation, E) -> np.ndarray:
    arrays = (spaces.G, spaces.h, spaces.active, spaces.binds)
    return worst_rows(HalfSpaces(*(a[None] for a in arrays)), (p[None], xi[None], m[None, None]), formation, E)[0]


def test_each_certificate_says_what_its_formula_says():
    """At random half-spaces of random teams; what is predicted is simulated tick by tick."""
    rng, order = np.random.default_rng(41), []
    for _ in range(12):
        model, _ = random_team(rng)
        n, E = model.robots, rows_of_model(model)
        p, xi, m = random_states(rng, n)
        formation, spaces = rng.normal(size=(n, 2)), HalfSpaces.empty(n, 2)
        for i, k in np.ndindex(n, 2):
            if rng.random() < 0.7:
                spaces.G[i, k], spaces.h[i, k], spaces.active[i, k] = unit(rng), rng.normal(), True
                spaces.binds[i, k] = rng.random(n) < 0.6
        ball, directional, predictive = at_one_tick(spaces, p, xi, m, formation, E)
        bound = np.argwhere(spaces.binds)
        rest = [spaces.G[i, k] @ (m + formation[j]) - spaces.h[i, k] for i, k, j in bound]
        along = [rho_along(spaces.G[i, k], m, p, xi) for i, k, _ in bound]
        if not rest:
            assert ball == directional == predictive == -np.inf
            continue
        assert ball == pytest.approx(rho(m, p, xi) + max(rest))
        assert directional == pytest.approx(max(np.add(rest, along)))
        worst, points = max(rest), -np.inf
        ahead, seen = (p, xi), set(PredictionGrid.of(model).tick.tolist())
        for t in range(PredictionGrid.of(model).horizon + 1):
            value = max(spaces.G[i, k] @ (ahead[0][j] + formation[j]) - spaces.h[i, k] for i, k, j in bound)
            worst, points = max(worst, value), max(points, value) if t in seen else points
            ahead = model.predicted(*ahead, m, 1)
        assert predictive == pytest.approx(max(points, *rest), abs=1e-9)
        assert predictive <= worst + 1e-9 <= predictive + 1e-3 * max(along) + 2e-9
        order.append((ball - directional, directional - predictive))
    assert np.min(order) >= -1e-9
    assert np.max(order, axis=0).min() > 0.01


def test_the_norm_along_a_direction_never_grows_in_continuous_time_and_is_at_most_rho():
    """Whatever the direction, under constant m; sampled it grows by Gamma at most, and comes close to it."""
    rng, nearest = np.random.default_rng(42), 0.0
    for _ in range(20):
        model, A = random_team(rng)
        p, xi, m = random_states(rng, model.robots)
        G = unit(rng)
        assert rho_along(G, m, p, xi) <= rho(m, p, xi) + 1e-12
        x = np.concatenate([(p - m) @ G, xi @ G])
        step, before = expm(0.01 * A), np.linalg.norm(x)
        for _ in range(300):
            x = step @ x
            assert np.linalg.norm(x) <= before + 1e-12
            before = np.linalg.norm(x)
        power = model.after(0)
        for _ in range(200):
            power = power @ model.moving_part
            worst = np.linalg.svd(power)[2][0]  # the state that grows most by now
            grown = float(np.linalg.norm(power @ worst))
            assert grown <= model.growth * (1 + 1e-12)
            nearest = max(nearest, (grown - 1.0) / max(model.growth - 1.0, 1e-12)) if model.growth > 1.0 else nearest
    assert nearest == pytest.approx(1.0, abs=1e-6)


def no_horizon(model: TeamModel) -> PredictionGrid:
    """P_0: the positions now, and the tail from now on."""
    n = model.robots
    E = np.stack([model.after(0)[:n], np.zeros((n, 2 * n))], axis=1)
    bound = np.column_stack([np.zeros(n), np.full(n, model.growth * np.linalg.norm(model.after(0), 2))])
    return PredictionGrid(np.zeros(2, dtype=np.int64), E.reshape(-1, 2 * n), 1.0 - E @ model.at_rest, bound)


def test_the_prediction_without_a_horizon_is_the_directional_ball():
    """P_0 asks of the held m what the directional ball with Gamma asks, and P_T never more."""
    rng, answers = np.random.default_rng(43), []
    for _ in range(150):
        model, _ = random_team(rng)
        n, formation = model.robots, rng.normal(size=(model.robots, 2))
        p, xi, m = random_states(rng, n)
        G, binds = unit(rng), rng.random(n) < 0.7
        edge = model.growth * rho_along(G, m, p, xi) + (G @ (m + formation).T)[binds].max(initial=-9.0)
        spaces = half_space(G, edge + rng.choice([-1.0, 1.0]) * 10.0 ** rng.uniform(-6, 0), binds)
        certificates = (
            DirectionalBall(formation, model.growth, 0.0),
            PredictiveCertificate(no_horizon(model), formation, 0.0),
            PredictiveCertificate(PredictionGrid.of(model), formation, 0.0),
        )
        found = []
        for certificate in certificates:
            rows = certificate.rows_at(spaces, p, xi, m)
            found.append(bool(np.all((rows.C @ m - rows.d)[rows.active] <= 1e-9)))
        assert found[0] == found[1]
        assert found[2] or not found[1]
        answers.append(tuple(found))
    assert {(True, True, True), (False, False, True)} <= set(answers)


def largest_lie(model: TeamModel, j: int, bound: np.ndarray, rng: np.random.Generator) -> float:
    """Return the largest found max_t E_j(t) e over what the rows of robot j say it is at most, on ||e|| = 1.

    States are scaled to the rows' boundary; the search begins with those that a tick between two points likes best.
    """
    grid, n = PredictionGrid.of(model), model.robots
    every, x = [], model.after(0)[j]
    for _ in range(grid.horizon + 300):
        every.append(x)
        x = x @ model.moving_part
    every = np.array(every)
    rows, ticks = grid.E.reshape(n, -1, 2 * n)[j], grid.tick[:-1]

    def lie(e: np.ndarray) -> float:
        e = e / np.linalg.norm(e)
        return float((every @ e).max() - (rows @ e + bound).max())

    starts = [every[(a + b) // 2] - 0.5 * (every[a] + every[b]) for a, b in pairwise(ticks) if b > a + 1]
    starts += [every[(a + b) // 2] for a, b in pairwise(ticks) if b > a + 1][:5]
    best, worst = rng.normal(size=2 * n), -np.inf
    for e in starts:
        if lie(e) > worst:
            best, worst = e, lie(e)
    best = best / np.linalg.norm(best)
    for k in range(300):
        other = best + 0.5 * 0.98**k * rng.normal(size=2 * n)
        other[n:] -= other[n:].mean()
        if lie(other) > worst:
            best, worst = other / np.linalg.norm(other), lie(other)
    return worst


def test_no_search_finds_a_state_whose_rows_lie():
    """Over random graphs, gains and ticks. The same search without the grid's bound does find some."""
    rng, without = np.random.default_rng(44), []
    for _ in range(8):
        model, _ = random_team(rng)
        grid, j = PredictionGrid.of(model), int(rng.integers(model.robots))
        assert largest_lie(model, j, grid.bound[j], rng) <= 1e-12
        without.append(largest_lie(model, j, np.zeros_like(grid.bound[j]), rng))
    assert max(without) > 1e-4


@pytest.mark.parametrize("certificate", ["predictive", "directional_ball"])
def test_the_certified_governor_never_violates_its_own_certificate(certificate: str, tmp_path):
    """In the ideal plant, and the log names the certificate, its horizon and its steps."""
    overrides = {"governor.kind": "certified", "governor.certificate": certificate, "reference.solver": "none"}
    run = pbrg.run(pbrg.load("paper/simulation_inadmissible", overrides, duration=8.0), log=tmp_path / "a.mcap")
    found = run.metrics
    assert (found.own_certificate, found.own_certificate_violated_share) == (certificate, 0.0)
    assert found.certificate_violated_share > 0.1  # the ball's, which asks for more than is needed
    assert np.all(run[f"{certificate}_row_m"] <= 1e-6)
    assert run.predictive_row_m.max() <= run.directional_ball_row_m.max() <= run.ball_row_m.max()
    horizon = found.own_certificate_horizon_s
    assert horizon > 10.0 if certificate == "predictive" else horizon == 0.0
    assert NAMES == ("ball", "directional_ball", "predictive")
    named = metadata(tmp_path / "a.mcap")[channels.CERTIFICATE_METADATA]
    assert named["name"] == certificate
    assert float(named["horizon_s"]) == pytest.approx(horizon)
    assert ("grid_points" in named) == (certificate == "predictive")


def metadata(path) -> dict[str, dict[str, str]]:
    from mcap.reader import make_reader

    with path.open("rb") as file:
        return {one.name: one.metadata for one in make_reader(file).iter_metadata()}


def test_tables_mark_the_runs_own_certificate_and_none_where_it_asks_none():
    for kind, marked in (("distributed", 1), ("none", 0)):
        overrides = {"governor.kind": kind, "reference.solver": "none"}
        table = comparison_table([pbrg.run(pbrg.load("paper/simulation_near", overrides, duration=0.2)).metrics])
        assert table.count("(own)") == marked
        assert ("ball row, largest [m]" in table) and ("predictive row, largest [m]" in table)
