"""Scenario texts for the tests of the scenario package."""

THREE = """\
# three robots in a row
seed: 3
team:
  start: [[0, 0], [1, 0], [2, 0]]
  heading_deg: [0, 90, 180]
  formation: [[-1, 0], [0, 0], [1, 0]]
  leaders: [3]
operator:
  reference: [1, 2.5]
"""


def three(**sections: str) -> str:
    """Return THREE with more sections, each given as flow YAML, from line 10 on."""
    return THREE + "".join(f"{key}: {value}\n" for key, value in sections.items())


def swapped(old: str, new: str) -> str:
    """Return THREE with one piece of it swapped."""
    assert THREE.count(old) == 1
    return THREE.replace(old, new)
