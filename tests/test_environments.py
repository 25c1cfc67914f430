"""Environments for learning: the libraries' own tests, and the closed loop's values."""

import re
import sys
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

import pbrg_mj as pbrg
from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.loop.tick_data import ExternalCommand
from pbrg_mj.scenario.schema import operator_reference
from tests.needs import need_module

check_env = need_module("gymnasium.utils.env_checker").check_env
zoo = need_module("pettingzoo.test")

from pbrg_mj.environments import Options, Step, TeamEnv, TeamVectorEnv, distance_reward, parallel_env  # noqa: E402
from pbrg_mj.environments.episode import Episode  # noqa: E402
from pbrg_mj.environments.worlds import Worlds  # noqa: E402

ROOT = Path(__file__).parents[1]

IDEAL = pbrg.load("paper/simulation_near", {"reference.solver": "none"}, duration=1.0)
PHYSICS = pbrg.load("paper/experiment_near", {"reference.solver": "none"}, seed=5, duration=0.5)
FILTERED = {"governor.kind": "cbf"}
TO_THE_WALL = np.array([1.0, 1.0])


def test_pettingzoo_accepts_references_and_velocities() -> None:
    zoo.parallel_api_test(parallel_env(IDEAL), num_cycles=30)
    zoo.parallel_api_test(parallel_env(IDEAL.override(FILTERED), actions="velocities"), num_cycles=30)
    zoo.parallel_seed_test(lambda: parallel_env(PHYSICS), num_cycles=5)


def test_gymnasium_accepts_half_spaces_and_scans() -> None:
    check_env(TeamEnv(IDEAL), skip_render_check=True)
    check_env(TeamEnv(PHYSICS, observations="scans"), skip_render_check=True)


def test_a_batch_has_a_world_at_least() -> None:
    with pytest.raises(pbrg.InputError, match="worlds: is 0; allowed: 1 or more"):
        TeamVectorEnv(IDEAL, 0)


WRONG_ACTIONS = {
    "not finite": [np.array([np.nan, 0.0]), np.array([0.0, np.inf])],
    "shape": [np.zeros(1), np.zeros(4), np.zeros((2, 2)), np.zeros(0), 0.5],
    "no array of numbers": ["left", None, np.array(["a", "b"]), [[0.0], [0.0, 1.0]], np.array([{}, {}])],
}


@pytest.mark.parametrize("said", WRONG_ACTIONS)
def test_wrong_actions_are_one_line_and_change_nothing(said: str) -> None:
    alone, several = TeamEnv(IDEAL), parallel_env(IDEAL)
    alone.reset(seed=3)
    several.reset(seed=3)
    for action in WRONG_ACTIONS[said]:
        if action is not None:
            with pytest.raises(pbrg.InputError, match=said):
                alone.step(action)  # type: ignore[arg-type]
            with pytest.raises(pbrg.InputError, match=said):
                several.step({several.agents[0]: action})  # type: ignore[dict-item]
    fresh = TeamEnv(IDEAL)
    fresh.reset(seed=3)
    expected = fresh.step(np.array([0.5, 0.25]))[0]
    np.testing.assert_array_equal(alone.step(np.array([0.5, 0.25]))[0], expected)


def test_no_step_is_taken_before_reset_after_the_end_or_after_close() -> None:
    alone, several, worlds = TeamEnv(IDEAL), parallel_env(IDEAL), TeamVectorEnv(PHYSICS, 2, threads=1)
    still, nobody = np.zeros(2), pytest.raises(pbrg.InputError, match="no episode is under way; call reset first")
    with nobody:
        alone.step(still)
    with nobody:
        several.step({"robot_5": still})
    with nobody:
        worlds.step(np.zeros((2, 2)))
    alone.reset(seed=1)
    while not any(alone.step(still)[2:4]):
        pass
    with nobody:
        alone.step(still)
    for env in (alone, several, worlds):
        env.reset(seed=1)
        env.close()
        with nobody:
            env.step({"robot_5": still} if env is several else still)  # type: ignore[arg-type]


def test_wrong_seeds_are_one_line() -> None:
    worlds = TeamVectorEnv(PHYSICS, 2, threads=1)
    for env in (TeamEnv(IDEAL), parallel_env(IDEAL), worlds):
        for seed in (-1, 0.5, "x"):
            with pytest.raises(pbrg.InputError, match="seed: "):
                env.reset(seed=[seed, 1] if env is worlds else seed)  # type: ignore[arg-type]
    with pytest.raises(pbrg.InputError, match="seed: are 3; allowed: one, or 2"):
        worlds.reset(seed=[1, 2, 3])
    assert worlds.reset(seed=np.int64(4))[1]["seed"].tolist() == [4, 5]  # type: ignore[arg-type]
    with pytest.raises(pbrg.InputError, match=r"shape \(2, 3\); allowed: 4 numbers"):
        worlds.step(np.zeros((2, 3)))


@pytest.mark.parametrize("kind", ["distributed", "certified"])
@pytest.mark.parametrize("scenario", [IDEAL, PHYSICS], ids=["ideal", "physics"])
def test_asking_for_the_operators_reference_is_the_run(scenario: pbrg.Scenario, kind: str) -> None:
    settings = scenario.override({"governor.kind": kind}).settings
    simulation = Simulation.build(settings)
    alone = [(tick.problem.p, tick.solution.m, tick.command) for tick in simulation.control_ticks()]
    episode = Episode(Simulation.build(settings).loop, Options(period=settings.timing.tick))
    for k, (p, m, command) in enumerate(alone[:-1]):
        episode.take_command(ExternalCommand(reference=operator_reference(settings.operator, k * settings.timing.tick)))
        np.testing.assert_array_equal(episode.command(), command)
        episode.loop.world.advance(command)
        truth = episode.loop.world.truth()
        episode.record(truth)
        tick = episode.step().tick
        np.testing.assert_array_equal(tick.problem.p, p)
        np.testing.assert_array_equal(tick.solution.m, m)
    assert episode.timed_out


def test_eq_2_as_actions_is_the_team_without_a_governor() -> None:
    """What robots observe is enough for the velocities of eq. 2; actions are float32 shares of the speed."""
    scenario = IDEAL.override({"governor.kind": "none"})
    env = parallel_env(scenario, actions="velocities", period=scenario.settings.timing.tick, speed=20.0)
    alone = [tick.hand_world for tick in Simulation.build(scenario.settings).control_ticks()]
    alpha_r, parts = scenario.settings.control.alpha_r, env.layout.parts
    told, _ = env.reset(seed=1)
    while env.agents:
        actions = {}
        for name, seen in told.items():
            apart, turned = np.split(seen[parts["neighbours"]].reshape(-1, 4).sum(axis=0), 2)
            actions[name] = (apart - turned + alpha_r * seen[parts["goal"]]) / 20.0
        told, *_ = env.step(actions)
    goal = operator_reference(scenario.settings.operator, 0.0)
    leader = int(np.flatnonzero([name == f"robot_{scenario.settings.team.leaders[0]}" for name in told])[0])
    seen = list(told.values())[leader]
    place = goal - seen[parts["goal"]] + np.array(scenario.settings.team.formation)[leader]
    np.testing.assert_allclose(place, alone[-1][leader], atol=1e-4)


def test_worlds_side_by_side_are_those_of_their_seeds() -> None:
    scenario = PHYSICS.override({"governor.kind": "certified"})
    many, alone = TeamVectorEnv(scenario, 2, threads=1), TeamEnv(scenario)
    actions = np.random.default_rng(3).uniform(-1, 1, (5, *many.action_space.shape)).astype(np.float32)
    first, told = many.reset(seed=[7, 3])
    assert told["seed"].tolist() == [7, 3]
    together = [first, *(many.step(action)[0] for action in actions)]
    rewards = many.reset(seed=[7, 3]) and [many.step(action)[1] for action in actions]
    for world, seed in enumerate((7, 3)):
        observed, _ = alone.reset(seed=seed)
        np.testing.assert_array_equal(together[0][world], observed)
        for k, action in enumerate(actions):
            observed, reward, terminated, truncated, _ = alone.step(action[world])
            np.testing.assert_array_equal(together[k + 1][world], observed)
            assert reward == rewards[k][world]
            assert (terminated, truncated) == (False, k == len(actions) - 1)
    with pytest.raises(pbrg.InputError, match="call reset first"):
        many.step(actions[0])


def test_a_family_draws_another_world_for_every_seed() -> None:
    family = pbrg.load("families/boxes", {"draw.team.robots": 4}, duration=0.2)
    env = TeamEnv(family)
    worlds = [env.reset(seed=seed)[0] for seed in (1, 2, 1)]
    assert not np.array_equal(worlds[0], worlds[1])
    np.testing.assert_array_equal(worlds[0], worlds[2])
    with pytest.raises(pbrg.InputError, match=r"draw\.team\.robots=5"):
        varied = TeamEnv(pbrg.load("families/boxes", {"governor.kind": "none"}, duration=0.2), actions="velocities")
        for seed in range(1, 20):
            varied.reset(seed=seed)


def test_contact_ends_an_episode_and_costs_ten() -> None:
    """The wall stands behind x + y = 3."""
    env = parallel_env(_towards_the_wall(), actions="velocities", speed=1.0)
    env.reset(seed=1)
    rewards, ended = {}, {}
    for _ in range(60):
        _, rewards, ended, _, told = env.step(dict.fromkeys(env.agents, TO_THE_WALL))
        if not env.agents:
            break
    assert all(ended.values())
    assert min(rewards.values()) < -10.0
    assert all(one["touched"] for one in told.values())


@pytest.mark.parametrize(
    ("layer", "actions"),
    [
        ({"governor.kind": "certified"}, "references"),
        ({"governor.kind": "cbf"}, "velocities"),
        ({"governor.kind": "potential_field"}, "velocities"),
        ({"governor.kind": "cbf", "control.separation": 0.22}, "velocities"),
    ],
)
def test_the_safety_layer_keeps_the_line_that_actions_alone_cross(layer: dict[str, object], actions: str) -> None:
    """Robot 5, the leader, alone knows of the line, so it alone moves where robots have velocities."""
    assert _least_margin(_towards_the_wall(), actions) < 0.0
    assert _least_margin(_towards_the_wall().override(layer), actions) > -1e-9


def test_separation_alone_stops_a_robot_late_at_a_line_in_physics() -> None:
    """It takes velocities for those of eq. 2, whose way a certificate keeps; the barrier stops the robot before."""
    physics = pbrg.load("paper/experiment_near", {"reference.solver": "none", "governor.kind": "none"}, duration=10.0)
    apart = physics.override({"control.separation": 0.22})
    least = _least_margin(apart, "velocities", speed=0.3)
    assert -0.03 < least < -0.01
    assert _least_margin(apart.override({"governor.kind": "cbf"}), "velocities", speed=0.3) > 0.05


def _least_margin(scenario: pbrg.Scenario, actions: str, speed: float = 1.0) -> float:
    """Return how near robot 5 comes to the wall that it is sent to [m]."""
    env = parallel_env(scenario, actions=actions, speed=speed, reach=5.0)
    env.reset(seed=1)
    least = np.inf
    while env.agents:
        wanted = dict.fromkeys(env.agents, np.zeros(2)) | {"robot_5": TO_THE_WALL}
        *_, told = env.step(wanted)
        least = min(least, *(info["wall_margin_m"] for info in told.values()))
    return least


@pytest.mark.parametrize("kind", ["none", "cbf", "potential_field"])
def test_separation_keeps_velocities_from_driving_robots_into_each_other(kind: str) -> None:
    """All go to the origin."""
    assert _least_distance({"governor.kind": kind}) < 0.15
    assert _least_distance({"governor.kind": kind, "control.separation": 0.22}) >= 0.22 - 1e-9


def _least_distance(keys: dict[str, object]) -> float:
    places: list[np.ndarray] = []

    def noted(step: Step) -> np.ndarray:
        places.append(step.hand_world.copy())
        return np.zeros(5)

    env = parallel_env(_towards_the_wall().override(keys), actions="velocities", reward=noted)
    env.reset(seed=1)
    env.step(dict.fromkeys(env.agents, np.zeros(2)))
    while env.agents:
        env.step({name: -places[-1][k] for k, name in enumerate(env.possible_agents)})
    one, other = np.triu_indices(5, 1)
    return min(np.linalg.norm(at[one] - at[other], axis=1).min() for at in places)


@pytest.mark.parametrize("kind", ["certified", "rollout", "distributed", "centralized"])
def test_governors_of_references_do_not_stand_between_velocities_and_wheels(kind: str) -> None:
    with pytest.raises(pbrg.InputError) as error:
        TeamEnv(_towards_the_wall().override({"governor.kind": kind}), actions="velocities")
    assert str(error.value) == (
        f"governor.kind: is {kind}, which governs references alone; "
        "allowed with velocities as actions: none, cbf, potential_field"
    )


def test_a_reward_of_ones_own_is_taken() -> None:
    def still(step: Step) -> np.ndarray:
        return distance_reward(step) * 0.0 + step.time

    env = TeamEnv(IDEAL, reward=still)
    env.reset(seed=1)
    assert env.step(np.zeros(2))[1] == pytest.approx(0.1)
    wrong = TeamEnv(IDEAL, reward=lambda step: np.zeros(1))
    wrong.reset(seed=1)
    with pytest.raises(pbrg.PlugInError, match="a number for each robot"):
        wrong.step(np.zeros(2))


@pytest.mark.parametrize(
    ("scenario", "keys", "said"),
    [
        (IDEAL, {"actions": "torques"}, "allowed: references or velocities"),
        (IDEAL, {"period": 0.0145}, "whole number of ticks"),
        (IDEAL, {"reach": -1.0}, "a number above 0"),
        (IDEAL, {"actions": "velocities"}, "governor.kind: is distributed, which governs references alone; allowed"),
        (IDEAL, {"observations": "scans"}, "no robot has beams"),
    ],
)
def test_wrong_options_are_one_line(scenario: pbrg.Scenario, keys: dict[str, object], said: str) -> None:
    with pytest.raises(pbrg.InputError, match=said) as error:
        TeamEnv(scenario, **keys)
    assert "\n" not in str(error.value)


def test_an_episode_that_ends_early_pays_for_the_time_left() -> None:
    """As if the robots had stood there until the end: 2 m from its place for 0.1 + 3 s, and a contact."""
    n, env = 5, TeamEnv(IDEAL, reward=lambda step: steps.append(step) or distance_reward(step))
    steps: list[Step] = []
    env.reset(seed=1)
    env.step(np.zeros(2))
    away, touched = np.tile([2.0, 0.0], (n, 1)), np.arange(n) == 1
    step = steps[0]._replace(hand_world=steps[0].target + away, duration=0.1, remaining=3.0, touched=touched)
    np.testing.assert_allclose(distance_reward(step), -6.2 - 10.0 * touched)
    np.testing.assert_allclose(distance_reward(step._replace(touched=np.zeros(n, dtype=bool))), -0.2)


ONE_BY_ONE = {
    "ideal": IDEAL,
    "family": pbrg.load("families/boxes", {"draw.team.robots": 3, "set_up": "recommended"}, duration=0.4),
    "moving boxes": pbrg.load("families/moving_boxes", {"draw.team.robots": 3}, duration=0.4),
    "radio": PHYSICS.override({"radio.delay": 0.02}),
}


@pytest.mark.parametrize("kind", ONE_BY_ONE)
def test_what_no_batch_steps_is_a_vector_environment_too(kind: str) -> None:
    """Each world is that of its seed alone, bit for bit, from one reset to the next."""
    scenario = ONE_BY_ONE[kind]
    many, alone = TeamVectorEnv(scenario, 3), TeamEnv(scenario)
    for first in (11, 21):
        observed, info = many.reset(seed=first)
        assert info["seed"].tolist() == [first, first + 1, first + 2]
        assert not np.array_equal(observed[0], observed[1]) or kind == "ideal"  # which has no noise
        actions = np.random.default_rng(first).uniform(-1, 1, (4, *many.action_space.shape)).astype(np.float32)
        steps = [many.step(one) for one in actions]
        for world in range(3):
            expected, _ = alone.reset(seed=first + world)
            np.testing.assert_array_equal(observed[world], expected)
            for action, (seen, rewards, _, _, infos) in zip(actions, steps, strict=True):
                expected, reward, _, _, told = alone.step(action[world])
                np.testing.assert_array_equal(seen[world], expected)
                assert (rewards[world], infos["wall_margin_m"][world]) == (reward, told["wall_margin_m"])


def test_worlds_of_other_teams_or_durations_are_refused() -> None:
    boxes = pbrg.load("families/boxes", {"governor.kind": "none"}, duration=0.2)
    with pytest.raises(pbrg.InputError, match=r"seed \d+ draws \d acting robots in place of 5; .* draw.team.robots=5"):
        TeamVectorEnv(boxes, 12, actions="velocities").reset(seed=1)
    other_beams = r"draws \d+ beams of a robot in place of 72; .* sensors.beams.preset=generic"
    with pytest.raises(pbrg.InputError, match=other_beams):
        TeamVectorEnv(boxes.override({"draw.team.robots": 4}), 24, observations="scans").reset(seed=1)
    durations = {"draw.keys": {"timing.duration": {"choice": [0.2, 0.4]}}}
    with pytest.raises(pbrg.InputError, match="worlds of several durations or ticks"):
        TeamVectorEnv(pbrg.load("families/boxes", durations), 4).reset(seed=1)


def test_drawing_goes_on_from_a_seed_given() -> None:
    worlds = Worlds(IDEAL, Options())
    assert worlds.next_seed(4) == 4
    after = [worlds.next_seed(None), worlds.next_seed(None)]
    assert worlds.next_seed(4) == 4
    assert [worlds.next_seed(None), worlds.next_seed(None)] == after


def _towards_the_wall() -> pbrg.Scenario:
    return pbrg.load("paper/simulation_near", {"reference.solver": "none", "governor.kind": "none"}, duration=6.0)


def test_the_pages_snippet_runs() -> None:
    for snippet in re.findall(r"```python\n(.*?)```", (ROOT / "docs" / "learn.md").read_text("utf-8"), re.DOTALL):
        exec(compile(snippet, "learn.md", "exec"), {"__name__": "page"})


def test_without_the_libraries_one_line_says_what_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "gymnasium", None)
    monkeypatch.delitem(sys.modules, "pbrg_mj.environments.team")
    with pytest.raises(pbrg.InputError, match="environments need gymnasium: pip install gymnasium"):
        import_module("pbrg_mj.environments").TeamEnv  # noqa: B018


@pytest.mark.slow
def test_the_worked_example_learns() -> None:
    """Four iterations from another seed than the page's earn more than doing nothing, in other worlds."""
    sys.path.insert(0, str(ROOT / "scripts"))
    try:
        example = import_module("train_policy")
    finally:
        sys.path.pop(0)
    env = example.environment()
    learned = np.array(example.trained(env, iterations=4, seed=2)[-1]["gains"])
    earned = [[example.episode_return(env, gains, k) for k in range(2001, 2006)] for gains in (learned, 0.0 * learned)]
    assert np.median(earned[0]) > np.median(earned[1]) + 1.0
