"""Write docs/gallery.md and its videos in docs/img/gallery: run bundled scenarios, render their logs.

python scripts/make_gallery.py                  # every video
python scripts/make_gallery.py corner doorway   # some of them; the page is written in any case
python scripts/make_gallery.py --logs DIR       # keep the logs in DIR, and render those that are there already
python scripts/make_gallery.py --check          # exit with 1 if page or videos are not those of this script

A video is an animated WebP, shown by browsers like any picture. Rendering needs PyAV and a software GL: docs/video.md.
"""

from __future__ import annotations

import argparse
import os
import shlex
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from pbrg_mj.cli.main import main as pbrg

DOCS = Path(__file__).resolve().parents[1] / "docs"
PAGE, FOLDER = DOCS / "gallery.md", DOCS / "img" / "gallery"
SIZE, FPS = "640x360", 10
LARGEST, ALL_TOGETHER = 1_000_000, 6_000_000  # [bytes]
HEAD = """# Gallery

<!-- Written by scripts/make_gallery.py: change it there. -->

Bundled scenarios, with their commands below each. [Videos and stills](video.md) explains the layers: robots in their
colours, each robot's reference m_i (disc) and where it is sent, m_i + b_i (pale disc), the operator's reference r (red
star), the centralized optimum m\\* (black cross), beams, and every half-space that a robot senses, shaded on its
forbidden side. `python scripts/make_gallery.py` makes them all again.
"""


@dataclass(frozen=True)
class Video:
    """One video of one scenario."""

    name: str
    title: str
    shows: str
    scenario: str
    end: float  # of the run and the video [s]
    speed: float  # simulated seconds per second
    start: float = 0.0  # of the video [s]
    camera: str = "top"
    hide: str = "beams,text"

    @property
    def run(self) -> list[str]:
        """The command that simulates it."""
        return ["run", self.scenario, "--duration", f"{self.end:g}", "-o", f"{self.name}.mcap"]

    @property
    def render(self) -> list[str]:
        """The command that renders the log."""
        start = ["--start", f"{self.start:g}"] if self.start else []
        hide = ["--hide", self.hide] if self.hide else []
        look = ["--camera", self.camera, "--size", SIZE, "--fps", f"{FPS}", "--speed", f"{self.speed:g}"]
        return ["render", f"{self.name}.mcap", "-o", f"{self.name}.webp", *look, *start, *hide]


VIDEOS = (
    Video(
        "experiment_near",
        "The paper's experiment, r near the wall",
        "Only the leader, robot 5, sees the wall. The formation around r fits before it, and the team converges to it.",
        "paper/experiment_near",
        end=60.0,
        speed=8.0,
        camera="chase",
        hide="text",
    ),
    Video(
        "experiment_inadmissible",
        "The paper's experiment, r behind the wall",
        "The operator asks for what the wall forbids. References and robots converge to the optimum before it.",
        "paper/experiment_inadmissible",
        end=60.0,
        speed=8.0,
        hide="text",
    ),
    Video(
        "corner",
        "Two walls at once",
        "Both half-spaces of a concave corner are active at the best formation.",
        "obstacles/corner",
        end=40.0,
        speed=6.0,
        camera="chase",
    ),
    Video(
        "doorway",
        "Through a doorway",
        "Five robots pass a doorway of 1.8 m. Each post binds only the robots that see it.",
        "obstacles/doorway",
        end=40.0,
        speed=5.0,
        hide="beams,half_spaces,text",
    ),
    Video(
        "corridor",
        "Along a corridor",
        "The certificate's ball must fit between two walls, so the team only creeps along.",
        "obstacles/corridor",
        end=60.0,
        speed=7.5,
    ),
    Video(
        "moving_box",
        "A box drives past",
        "A box crosses 0.6 m before the team. The team neither stops for good nor remembers a wall.",
        "obstacles/moving_box",
        start=12.0,
        end=30.0,
        speed=3.0,
        camera="chase",
        hide="text",
    ),
    Video(
        "late_detection",
        "A wall seen too late",
        "Beams reach 1 m only. The team is too fast when the wall appears, and a robot touches it.",
        "sensing/late_detection",
        start=3.0,
        end=18.0,
        speed=2.5,
        camera="chase",
    ),
    Video(
        "push",
        "A push towards the wall",
        "Robot 4 is pushed with 3 N for half a second. Its neighbours draw it back, and no robot touches the wall.",
        "disturbances/push",
        start=28.0,
        end=40.0,
        speed=2.0,
        camera="chase",
    ),
    Video(
        "kidnapped_robot",
        "A kidnapped robot",
        "Robot 2 is lifted at 20 s and put down 1.35 m away. The references retreat until it is back in the formation.",
        "disturbances/carried_away",
        start=16.0,
        end=40.0,
        speed=2.5,
    ),
    Video(
        "delayed_plain",
        "Messages 0.8 s late, plain exchange",
        "Delay alone makes the references oscillate and diverge, and the team follows them across the line.",
        "network/delayed_plain",
        end=22.0,
        speed=2.75,
    ),
    Video(
        "delayed_scattering",
        "Messages 0.8 s late, scattering",
        "The same delay with wave variables: the references agree, and the team stops before the line.",
        "network/delayed_scattering",
        end=60.0,
        speed=7.5,
    ),
    Video(
        "fifty_robots",
        "Fifty robots",
        "Fifty robots on a grid network, one of them the leader, line up as a regular grid.",
        "scale/fifty_robots",
        end=15.0,
        speed=2.5,
    ),
)


def page() -> str:
    """Return the text of the page."""
    parts = [HEAD]
    for video in VIDEOS:
        commands = "\n".join(f"    pbrg {shlex.join(words)}" for words in (video.run, video.render))
        picture = f"![{video.title}](img/gallery/{video.name}.webp)"
        times = f"From {video.start:g} s to {video.end:g} s, {video.speed:g} times as fast."
        parts.append(f"## {video.title}\n\n{video.shows} {times}\n\n{picture}\n\n{commands}\n")
    return "\n".join(parts)


def make(video: Video, logs: Path) -> None:
    """Simulate and render it, by the commands of the page. Raises SystemExit when one fails."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    os.chdir(logs)
    # 1: the run failed its purpose, which some videos show
    if not Path(f"{video.name}.mcap").exists() and pbrg([*video.run, "--quiet"]) not in (0, 1):
        raise SystemExit(f"{video.name}: the run failed")
    if pbrg(video.render) != 0:
        raise SystemExit(f"{video.name}: rendering failed")
    made = Path(f"{video.name}.webp")
    (FOLDER / made.name).write_bytes(made.read_bytes())
    print(f"{video.name}: {made.stat().st_size / 1000:.0f} kB", flush=True)


def findings() -> Iterator[str]:
    """Yield what is wrong with page and videos."""
    if not PAGE.exists() or PAGE.read_text() != page():
        yield f"{PAGE.name} is not what this script writes"
    sizes = {path.stem: path.stat().st_size for path in FOLDER.glob("*.webp")}
    for name in sorted({video.name for video in VIDEOS} ^ sizes.keys()):
        yield f"{name}: {'no scenario' if name in sizes else 'no video'}"
    for name, size in sizes.items():
        if size > LARGEST:
            yield f"{name}: {size} bytes; at most {LARGEST}"
    if sum(sizes.values()) > ALL_TOGETHER:
        yield f"all together: {sum(sizes.values())} bytes; at most {ALL_TOGETHER}"


def main() -> int:
    parser = argparse.ArgumentParser(description="Write docs/gallery.md and its videos.")
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(video.name for video in VIDEOS))
    parser.add_argument("--logs", type=Path, help="keep the logs here")
    parser.add_argument("--check", action="store_true")
    asked = parser.parse_args()
    if unknown := set(asked.names) - {video.name for video in VIDEOS}:
        parser.error(f"no video {unknown.pop()!r}")
    if not asked.check:
        PAGE.write_text(page())
        with tempfile.TemporaryDirectory() as temporary:
            logs = (asked.logs or Path(temporary)).resolve()
            logs.mkdir(parents=True, exist_ok=True)
            for video in VIDEOS:
                if not asked.names or video.name in asked.names:
                    make(video, logs)
            os.chdir(DOCS)
    wrong = [] if asked.names else list(findings())
    print("\n".join(wrong), file=sys.stderr, end="\n" if wrong else "")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
