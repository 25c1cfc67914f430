"""Print the tables of docs/optimizers.md: each method's own parameters swept, the best of them taken.

python -m scripts.agreement static    # rounds of a problem that stands still; some minutes
python -m scripts.agreement moving    # gaps while the team drives; some minutes
python -m scripts.agreement certified # NIDS and ADMM at one round a tick under the certified layer; some minutes
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable
from itertools import product

import numpy as np

from pbrg_mj.governor.distributed.estimates import Flow
from pbrg_mj.governor.optimizers.admm import Admm
from pbrg_mj.governor.optimizers.flow_in_m import FlowInM
from pbrg_mj.governor.optimizers.interface import Optimizer
from pbrg_mj.governor.optimizers.nids import Nids
from scripts.agreement.linear_rate import nids_rate
from scripts.agreement.moving import Course, Moving, PaperFlow, Unverified, certified
from scripts.agreement.static import GRAPHS, Static, rounds_of_paper_flow, rounds_to_agree

MIXINGS, PENALTIES = (0.5, 0.7, 0.85, 1.0), (0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0)
STEPS = (0.1, 0.2, 0.3, 0.5, 0.7, 0.9)  # of NIDS
EULER, GAINS, AUGMENTATIONS = (0.05, 0.1, 0.15, 0.2, 0.25, 0.3), (0.2, 0.5, 1.0, 2.0), (0.5, 1.0, 2.0, 5.0)
PAPER_STEPS, PAPER_GAINS = (0.01, 0.02, 0.05, 0.1), (2.0, 7.0)
PAPER_MOST = 40_000  # rounds
Setting = tuple[str, Optimizer]


def nids(stiffest: float) -> Iterable[Setting]:
    """Yield NIDS with all parameters of the sweep; lambda_max(L) of the graph."""
    return ((f"step {c:g}, mixing {w:g}", Nids(c, w / stiffest)) for c, w in product(STEPS, MIXINGS))


def admm(stiffest: float) -> Iterable[Setting]:
    """Yield ADMM likewise."""
    return ((f"penalty {c:g}", Admm(c)) for c in PENALTIES)


def flow(augmentations: Iterable[float]) -> Callable[[float], Iterable[Setting]]:
    """Return the same of the flow in m."""
    return lambda stiffest: (
        (f"step {h:g}, gain {gain:g}, augmentation {k:g}", FlowInM(h, gain, k))
        for h, gain, k in product(EULER, GAINS, augmentations)
        if h * stiffest < 1.0
    )


METHODS = {
    "flow_in_m, plain": flow([0.0]),
    "flow_in_m, augmented": flow(AUGMENTATIONS),
    "nids": nids,
    "admm": admm,
}


def rounds_text(rounds: int | None, most: int) -> str:
    """Return a number of rounds as the table has it."""
    return f"> {most}" if rounds is None else str(rounds)


def static_table() -> None:
    """Print rounds until all agree within 1 cm, and the best parameters."""
    for name, make in GRAPHS.items():
        static: Static = make()
        stiffest = float(np.linalg.eigvalsh(static.network.laplacian)[-1])
        print(f"{name}: flooding {static.network.diameter}")
        as_run = rounds_of_paper_flow(Flow(2.0, 1e-3), static, PAPER_MOST)
        swept = {
            (a, h): rounds_of_paper_flow(Flow(a, h), static, PAPER_MOST) for a, h in product(PAPER_GAINS, PAPER_STEPS)
        }
        best = min((k for k in swept if swept[k] is not None), key=lambda k: swept[k] or 0, default=None)
        fewest = rounds_text(None if best is None else swept[best], PAPER_MOST)
        print(
            f"{name}: paper_flow as run {rounds_text(as_run, PAPER_MOST)}, best {fewest} at gain and step {best}",
            flush=True,
        )
        for method, settings in METHODS.items():
            most, chosen = 1500, "-"
            for text, optimizer in settings(stiffest):
                rounds = rounds_to_agree(optimizer, static, most)
                if rounds is not None and rounds < most:
                    most, chosen = rounds, text
            print(f"{name}: {method} {rounds_text(None if chosen == '-' else most, most)} at {chosen}", flush=True)


def moving_table() -> None:
    """Print mean gaps at 10, 2 and 1 rounds a tick, shares of violated ticks and bytes."""
    course = Course()
    stiffest = float(np.linalg.eigvalsh(course.team.laplacian)[-1])
    unverified = {
        "flow_in_m": FlowInM(0.25, 1.0, 1.0),
        "nids": Nids(0.5, 1.0 / stiffest),
        "admm": Admm(0.5),
    }
    for rounds in (10, 1, 2):
        print_moving(f"paper_flow, {rounds} rounds", course.run(PaperFlow(Flow(2.0, 0.01 / rounds), rounds, course)))
        for name, optimizer in unverified.items():
            print_moving(f"{name}, {rounds} rounds", course.run(Unverified(optimizer, course, rounds)))
        for name in ("flooding", "nids", "admm", "scalar"):
            keys = f"governor.optimizer={name}", f"governor.rounds={rounds}"
            print_moving(f"certified {name}, {rounds} rounds", certified(*keys))


def certified_table() -> None:
    """Print NIDS and ADMM under the certified layer at one round a tick, and NIDS' rate near the optimum."""
    team, owner = Course().team, 1
    stiffest, one = float(np.linalg.eigvalsh(team.laplacian)[-1]), "governor.rounds=1"
    for c, w in product((*STEPS, 0.55), MIXINGS):
        keys = "governor.optimizer=nids", f"governor.nids.step={c}", f"governor.nids.mixing={w}"
        rate = nids_rate(team, owner, c, w / stiffest)
        print_moving(f"nids, step {c:g}, mixing {w:g}, rate {rate:.3f}", certified(one, *keys))
    for c in PENALTIES:
        keys = "governor.optimizer=admm", f"governor.admm.penalty={c}"
        print_moving(f"admm, penalty {c:g}", certified(one, *keys))


def print_moving(name: str, found: Moving) -> None:
    """Print one line of the table."""
    gap, violated, sent = found
    print(f"{name}: mean gap {1000 * gap:.2f} mm, violated {violated:.1%}, {sent:.0f} bytes a tick", flush=True)


if __name__ == "__main__":
    tables = {"static": static_table, "moving": moving_table, "certified": certified_table}
    options = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    options.add_argument("table", choices=tables)
    tables[options.parse_args().table]()
