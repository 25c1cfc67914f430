"""The page's figures."""

from __future__ import annotations

from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np


def draw(found: dict, folder: Path) -> None:
    """Write the figures as PNG into `folder`, without dates or versions, so that equal data give equal bytes."""
    folder.mkdir(parents=True, exist_ok=True)
    figures = {"physics_motor": _motor, "physics_tracking": _tracking, "physics_floors": _floors}
    with plt.rc_context({"font.size": 9, "figure.dpi": 110, "axes.grid": True, "grid.alpha": 0.3}):
        for name, figure in figures.items():
            drawn = figure(found)
            drawn.savefig(folder / f"{name}.png", metadata={"Software": None})
            plt.close(drawn)


def _motor(found: dict) -> plt.Figure:
    figure, (left, middle, right) = plt.subplots(1, 3, figsize=(11, 3.4), layout="constrained")
    speed = found["speed_against_voltage"]
    left.plot(speed["voltage_V"], speed["closed_form_rad_s"], "k-", lw=1, label="closed form")
    left.plot(speed["voltage_V"], speed["stands_rad_s"], "o", mfc="none", label="wheels in the air")
    left.plot(speed["voltage_V"], speed["floor_rad_s"], "x", label="on the floor")
    left.set(xlabel="voltage [V]", ylabel="wheel speed [rad/s]", title="Speed against voltage")
    for kind, line in (("voltage", "o-"), ("speed_loop", "x-")):
        band = found["deadband"][kind]
        middle.plot(band["wanted_m_s"], band["moved_m_s"], line, ms=4, lw=1, label=kind)
    middle.set(xlabel="wanted [m/s]", ylabel="moved [m/s]", title="Deadband of the drives")
    energy = found["coasting"]["kinetic_J"]
    right.semilogy(0.01 * np.arange(len(energy)), energy, label="kinetic energy")
    right.axhline(found["coasting"]["bristles_can_store_J"], color="k", ls="--", lw=1, label="what bristles can store")
    right.set(xlabel="time after 3 V are cut [s]", ylabel="energy [J]", title="Coasting", ylim=(1e-12, 1e-1))
    for axes in (left, middle, right):
        axes.legend()
    return figure


def _tracking(found: dict) -> plt.Figure:
    figure, (paths, errors) = plt.subplots(1, 2, figsize=(9, 4), layout="constrained")
    colour = {"voltage": "C0", "speed_loop": "C1"}
    for (shape, kind, friction), run in found["tracking"].items():
        label, style = f"{kind}, {'with' if friction else 'no'} friction", "-" if friction else "--"
        off = np.linalg.norm(run["seen_m"] - run["wanted_m"], axis=1)
        if shape == "circle":
            paths.plot(*run["seen_m"].T, style, color=colour[kind], lw=1.2, label=label)
            errors.plot(0.01 * np.arange(1, len(off) + 1), 100 * off, style, color=colour[kind], lw=1.2, label=label)
    paths.plot(*found["tracking"]["circle", "voltage", 0.0]["wanted_m"].T, "k:", lw=1, label="wanted")
    paths.set(xlabel="x [m]", ylabel="y [m]", title="Hand point on a circle, by velocity alone", aspect="equal")
    errors.set(xlabel="time [s]", ylabel="distance from where it should be [cm]")
    paths.legend(fontsize=7)
    return figure


def _floors(found: dict) -> plt.Figure:
    figure, axes = plt.subplots(figsize=(8, 3.6), layout="constrained")
    names = list(found["floors"])
    for k, name in enumerate(names):
        error = 1000 * found["floors"][name]
        axes.bar(np.arange(len(error)) + 0.16 * (k - 2), error, width=0.15, label=name)
    axes.set_xticks(range(len(error)), [f"robot {j + 1}" for j in range(len(error))])
    axes.set(ylabel="static error [mm]", title="One governed team on different floors", yscale="log", ylim=(0.05, 1000))
    axes.legend(fontsize=7, ncols=2)
    return figure
