"""The figure of docs/network.md."""

from __future__ import annotations

from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt


def draw(found: dict, folder: Path) -> None:
    """Write network_delay.png into `folder`, without dates or versions, so that equal data give equal bytes."""
    with plt.rc_context({"font.size": 9, "figure.dpi": 110, "axes.grid": True, "grid.alpha": 0.3}):
        figure, (runs, delays, impedances) = plt.subplots(1, 3, figsize=(12, 3.6), layout="constrained")
        _runs(runs, found)
        _delays(delays, found)
        for delay, line in (("0.1", "o-"), ("0.4", "s-"), ("1", "^-")):
            impedances.plot(
                range(len(found["impedance"])), found[f"impedance_{delay}_s"], line, ms=4, label=f"delay {delay} s"
            )
        impedances.set_xticks(range(len(found["impedance"])), [f"{eta:g}" for eta in found["impedance"]])
        impedances.set(xlabel="impedance", ylabel="rate of log distance [1/s]", title="Impedance of the waves")
        impedances.legend()
        figure.savefig(folder / "network_delay.png", metadata={"Software": None})
        plt.close(figure)


def _runs(axes: plt.Axes, found: dict) -> None:
    for kind, colour in (("plain", "C3"), ("waves", "C0")):
        for delay, style in (("0.3", "--"), ("0.6", "-")):
            axes.semilogy(*found[f"run_{kind}_{delay}_s"], style, color=colour, label=f"{kind}, {delay} s")
    axes.set(xlabel="time [s]", ylabel="farthest m from the optimum [m]", title="Two delays", ylim=(1e-3, 1e4))
    axes.legend(fontsize=7)


def _delays(axes: plt.Axes, found: dict) -> None:
    for kind, colour in (("plain", "C3"), ("waves", "C0")):
        axes.plot(found["delay_s"], found[f"{kind}_per_s"], "o-", ms=4, color=colour, label=f"{kind}, all links alike")
        axes.plot(found["delay_s"], found[f"{kind}_uneven_per_s"], "x--", ms=5, color=colour, label=f"{kind}, uneven")
    axes.axhline(0.0, color="k", lw=1)
    axes.set(xlabel="mean delay [s]", ylabel="rate of log distance [1/s]", title="Above 0: diverges", ylim=(-0.07, 0.3))
    axes.legend(fontsize=7)
