"""Warnings before a run: a certificate that its governor does not apply."""

from __future__ import annotations

from pbrg_mj.scenario.schema import WITHOUT_GOVERNOR, Governor, Scenario


def certificate_warnings(scenario: Scenario) -> list[str]:
    """Return a line where r is applied as it comes, and a certificate is named: it shapes the optimum beside alone."""
    kind, name = scenario.governor.kind, scenario.governor.certificate
    if kind not in WITHOUT_GOVERNOR or name == Governor().certificate:
        return []
    why = f"with `governor.kind: {kind}` robots apply r as it comes"
    if scenario.reference.solver == "none":
        return [f"governor.certificate has no effect: {why}"]
    return [f"governor.certificate has no effect on the robots: {why}; {name} constrains the centralized optimum alone"]
