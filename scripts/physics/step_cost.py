"""What a physics step costs against a drive in one piece: a whole `dcmotor` with its friction, under implicitfast."""

from __future__ import annotations

import re
import time

import mujoco  # noqa: TID251
import numpy as np

from pbrg_mj.scenario.robots import robot_file
from pbrg_mj.world.scene.robot import load_arena

ROBOTS, TURNS, STEPS = 5, 60, 100  # steps of a turn
WHOLE = """<actuator>
  <dcmotor name="motor_left" joint="wheel_left" nominal="6 0.05 50" ctrlrange="-6 6" lugre="2 0.02 0.002 0.003 0.3"/>
  <dcmotor name="motor_right" joint="wheel_right" nominal="6 0.05 50" ctrlrange="-6 6" lugre="2 0.02 0.002 0.003 0.3"/>
</actuator>"""


def step_cost() -> dict[str, float]:
    """Return the processor time [us] of a step of five driven robots with either drive, and the ratios' median."""
    text = robot_file("generic").read_text(encoding="utf-8")
    whole = re.sub(r"<actuator>.*</actuator>", WHOLE, text, flags=re.DOTALL).replace(
        '<joint type="hinge" axis="0 1 0"/>', '<joint type="hinge" axis="0 1 0" armature="2e-5"/>'
    )
    models = {"apart": _team(text), "whole": _team(whole)}
    models["whole"].opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    states = {name: mujoco.MjData(model) for name, model in models.items()}
    took: dict[str, list[float]] = {name: [] for name in models}
    for turn in range(TURNS + 1):  # the first one, in which robots fall on the floor, does not count
        for name in sorted(models, reverse=bool(turn % 2)):
            states[name].ctrl[:] = 1.5 + np.sin(turn / 5 + np.arange(models[name].nu))
            began = time.process_time()
            mujoco.mj_step(models[name], states[name], nstep=STEPS)
            took[name].append(1e6 * (time.process_time() - began) / STEPS)
    apart, together = (np.array(took[name][1:]) for name in ("apart", "whole"))
    ratio = float(np.median(apart / together))
    return {"apart_us": float(np.median(apart)), "whole_us": float(np.median(together)), "ratio": ratio}


def _team(text: str) -> mujoco.MjModel:
    """Return five robots of an MJCF text, a metre apart."""
    arena = load_arena()
    for k in range(ROBOTS):
        robot = mujoco.MjSpec.from_string(text)
        for key in robot.keys:
            robot.delete(key)
        arena.attach(robot, prefix=f"robot{k}/", frame=arena.worldbody.add_frame(pos=[0, k, 0.02]))
    return arena.compile()
