"""Pictures to a file: .mp4 (H.264), .webm (VP9), .gif, .webp (animated), .png."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pbrg_mj.errors import InputError

if TYPE_CHECKING:
    import av

WHOLE_MILLIHERTZ = 1000  # frame rates are written to files as fractions over this


@dataclass(frozen=True)
class Format:
    """A kind of file that holds frames in time."""

    codec: str
    pixels: str
    options: dict[str, str]  # of the codec
    even: bool = False  # only sizes that are even both ways
    fps: float = 30.0  # the default
    fastest: float = 240.0  # [frames/s]
    container: dict[str, str] = field(default_factory=dict)  # options of the file


VP9 = {"deadline": "realtime", "cpu-used": "8", "row-mt": "1", "crf": "30", "b": "0"}
FORMATS = {
    ".mp4": Format("libx264", "yuv420p", {"preset": "veryfast", "crf": "20"}, even=True),
    ".webm": Format("libvpx-vp9", "yuv420p", VP9, even=True),
    # Times are hundredths of a second, and viewers slow down what is faster.
    ".gif": Format("gif", "pal8", {}, fps=12.5, fastest=50.0),
    # An animated picture: times are milliseconds, and it plays over and over.
    ".webp": Format("libwebp_anim", "yuv420p", {"quality": "80"}, fps=12.5, fastest=50.0, container={"loop": "0"}),
}
STILL = ".png"
SUFFIXES = (*FORMATS, STILL)


def need_av() -> None:
    """Raise InputError unless PyAV is installed."""
    try:
        import av  # noqa: F401
    except ImportError as error:
        raise InputError("pictures need PyAV: pip install av") from error


def write_movie(pictures: Iterable[np.ndarray], path: Path, fps: float, on_frame: Callable[[], None]) -> None:
    """Encode pictures (height, width, 3) RGB into `path`, whose suffix names the format; call `on_frame` after each."""
    import av

    kind = FORMATS[path.suffix.lower()]
    rate = Fraction(round(fps * WHOLE_MILLIHERTZ), WHOLE_MILLIHERTZ)
    name = path.suffix.lower()[1:]
    # bitexact: no random identifiers, the same log makes the same file
    with av.open(str(path), "w", format=name, options={"fflags": "+bitexact", **kind.container}) as container:
        stream: Any = container.add_stream(kind.codec, rate=rate, options=kind.options)
        stream.pix_fmt = kind.pixels
        palette: Any = None
        for number, picture in enumerate(pictures):
            frame: Any = av.VideoFrame.from_ndarray(np.ascontiguousarray(picture), format="rgb24")
            frame.pts, frame.time_base = number, 1 / rate
            if number == 0:
                stream.width, stream.height = frame.width, frame.height
                palette = _palette(frame, rate) if kind.pixels == "pal8" else None
            container.mux(stream.encode(palette(frame) if palette else frame))
            on_frame()
        container.mux(stream.encode(None))


def write_still(picture: np.ndarray, path: Path) -> None:
    """Write one picture (height, width, 3) RGB as PNG."""
    import av

    frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(picture), format="rgb24")
    encoder: Any = av.CodecContext.create("png", "w")
    encoder.width, encoder.height, encoder.pix_fmt = frame.width, frame.height, "rgb24"
    encoder.time_base = Fraction(1)
    packets = [*encoder.encode(frame), *encoder.encode(None)]
    path.write_bytes(b"".join(bytes(packet) for packet in packets))


def _palette(like: av.VideoFrame, rate: Fraction) -> Callable[[av.VideoFrame], av.VideoFrame]:
    """Return what gives every frame the 256 colours that suit it best."""
    from av.filter import Graph

    graph: Any = Graph()
    source = graph.add_buffer(width=like.width, height=like.height, format="rgb24", time_base=1 / rate)
    split = graph.add("split")
    choose = graph.add("palettegen", "stats_mode=single")
    use = graph.add("paletteuse", "new=1:dither=bayer:bayer_scale=4")
    sink = graph.add("buffersink")
    source.link_to(split)
    split.link_to(use, 0, 0)
    split.link_to(choose, 1, 0)
    choose.link_to(use, 0, 1)
    use.link_to(sink)
    graph.configure()  # the graph must outlive its parts, or the process dies: `paletted` keeps it

    def paletted(frame: av.VideoFrame) -> av.VideoFrame:
        graph.push(frame)
        return graph.pull()

    return paletted
