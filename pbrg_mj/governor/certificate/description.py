"""What a scenario's certificate is: its name, how far ahead it looks and in which steps."""

from __future__ import annotations

import math
from typing import NamedTuple

from pbrg_mj.governor.certificate.prediction_grid import PredictionGrid
from pbrg_mj.governor.certificate.team_model import TeamModel
from pbrg_mj.scenario.schema import WITHOUT_GOVERNOR, Scenario
from pbrg_mj.vehicle.motor_lag import motor_lag


class CertificateDescription(NamedTuple):
    """A certificate in a few words. The balls look at the present alone, and so have no steps."""

    name: str | None  # None: the governor asks none
    horizon_s: float  # 0 for the balls, NaN where it is not known
    horizon_ticks: int
    step_s: float  # of the model; NaN without one
    grid_points: int  # at which the prediction is looked at, the tail not counted
    delay_ticks: int | None = None  # of motors that are predicted; None: kinematic robots

    def as_metadata(self) -> dict[str, str]:
        """Return texts by name, those that mean something."""
        if self.name is None:
            return {"name": "none"}
        found = {"name": self.name}
        if not math.isnan(self.horizon_s):
            found |= {"horizon_s": f"{self.horizon_s:.9g}", "horizon_ticks": str(self.horizon_ticks)}
        if self.grid_points:
            found |= {"step_s": f"{self.step_s:.9g}", "grid_points": str(self.grid_points)}
        if self.delay_ticks is not None:
            found |= {"predicted_motion": "motors", "delay_ticks": str(self.delay_ticks)}
        return found


def describe(scenario: Scenario) -> CertificateDescription:
    """Return what a scenario's certificate is; of another package's only the name is known."""
    name = scenario.governor.certificate
    if scenario.governor.kind in WITHOUT_GOVERNOR:
        return CertificateDescription(None, math.nan, 0, math.nan, 0)
    if name in ("ball", "directional_ball"):
        return CertificateDescription(name, 0.0, 0, math.nan, 0)
    if name != "predictive":
        return CertificateDescription(name, math.nan, 0, math.nan, 0)
    grid, tick = PredictionGrid.of(TeamModel.of_scenario(scenario)), scenario.timing.tick
    lag = motor_lag(scenario)
    delay = None if lag is None else lag.delay
    return CertificateDescription(name, grid.horizon * tick, grid.horizon, tick, len(grid.tick) - 1, delay)
