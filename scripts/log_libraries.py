# ruff: noqa: TID251 - what is compared with is bare
"""What libraries would do in the log's place: time, size, and what is left of a damaged file. Prints Markdown tables.

python scripts/log_libraries.py    # some minutes

The run is that of scripts/perf with log and centralized reference at every tick. Writers take turns over the same
ticks. Times are CPU times of this process, so a busy machine does little to their ratios.
"""

from __future__ import annotations

import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator
from io import BytesIO
from itertools import islice
from operator import attrgetter
from pathlib import Path
from statistics import median
from time import process_time
from typing import BinaryIO

import numpy as np
from foxglove.mcap import MCAPCompression, MCAPWriteOptions
from foxglove_schemas_protobuf.LaserScan_pb2 import LaserScan
from mcap.records import Attachment, Message, Metadata
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, Writer
from performance.closed_loop import scenario

from pbrg_mj.log.read.mcap_records import MAGIC, read_records
from pbrg_mj.log.scene.messages import ScanMessage
from pbrg_mj.log.schema.fields import MESSAGES
from pbrg_mj.log.schema.message import LogMessage, set_timestamp
from pbrg_mj.log.schema.protobuf import CLASSES, encoder
from pbrg_mj.log.write import mcap_writer
from pbrg_mj.log.write import writer as log_writer
from pbrg_mj.log.write.mcap_writer import McapWriter
from pbrg_mj.log.write.messages import dims_of
from pbrg_mj.loop.record import TickRecord
from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.scenario.load import LoadedScenario

REPEATS = 9
ACCIDENTS = 300
NEVER = 2**62  # mcap's Writer ends no chunk by itself


class PythonWriter(Writer):
    """mcap's own Writer, called as the log calls its writer."""

    def __init__(self, file: BinaryIO, compression: CompressionType):
        super().__init__(file, chunk_size=NEVER, compression=compression, enable_data_crcs=True)
        self.start(library="pbrg_mj")
        self._file, self._numbers = file, Counter()

    def add_channel(self, topic: str, schema_name: str, schema_data: bytes) -> Callable[..., None]:
        number = self.register_channel(topic, "protobuf", self.register_schema(schema_name, "protobuf", schema_data))

        def add_message(data: bytes, log_time: int) -> None:
            self._numbers[number] += 1
            self.add_message(number, log_time, data, log_time, self._numbers[number])

        return add_message

    def flush(self) -> None:
        super().flush()
        self._file.flush()


def compiled(**options: object) -> Callable[[BinaryIO], McapWriter]:
    """Return what makes the log's own writer with other options."""

    def make(file: BinaryIO) -> McapWriter:
        fixed = {"chunk_size": None, "disable_seeking": True, "compression_threads": 0}
        mcap_writer.MCAPWriteOptions = lambda **_: MCAPWriteOptions(**fixed, **options)  # type: ignore[arg-type]
        return McapWriter(file)

    return make


WRITERS = {
    "foxglove-sdk, LZ4": compiled(compression=MCAPCompression.Lz4),
    "foxglove-sdk, zstd 1": compiled(compression_level=1),
    "foxglove-sdk, zstd 3": compiled(compression_level=3),
    "mcap, LZ4": lambda file: PythonWriter(file, CompressionType.LZ4),
    "mcap, zstd 3": lambda file: PythonWriter(file, CompressionType.ZSTD),
}


def logged_run(loaded: LoadedScenario, path: Path) -> float:
    """Return the log's time over that of the rest of a tick."""
    simulation, writing = Simulation.build(loaded.scenario), 0.0
    records = simulation.records()
    with log_writer.LogWriter(path, loaded, simulation.model_xml, force=True) as write:
        write(next(records))
        began = process_time()
        for record in records:
            before = process_time()
            write(record)
            writing += process_time() - before
        whole = process_time() - began
    return writing / (whole - writing)


def writers(loaded: LoadedScenario, folder: Path) -> None:
    shares: dict[str, list[float]] = {name: [] for name in WRITERS}
    for _ in range(REPEATS):
        for name, make in WRITERS.items():
            log_writer.McapWriter = make  # type: ignore[assignment,misc]
            shares[name].append(logged_run(loaded, folder / name))
    log_writer.McapWriter = McapWriter
    print("| writer | log: time added to a tick's compute | file [kB] |\n| --- | --- | --- |")
    for name, found in shares.items():
        print(f"| {name} | {median(found):.1%} | {(folder / name).stat().st_size / 1e3:.0f} |")


def each_in_turn(works: dict[str, Callable[[], object]], calls: int) -> dict[str, float]:
    """Return the median time of one call of each [us]."""
    times: dict[str, list[float]] = {name: [] for name in works}
    for _ in range(REPEATS):
        for name, work in works.items():
            began = process_time()
            for _ in range(calls):
                work()
            times[name].append((process_time() - began) / calls * 1e6)
    return {name: median(found) for name, found in times.items()}


def packing(record: TickRecord) -> None:
    dims, fields = dims_of(record), MESSAGES["Tick"]
    ours = encoder("Tick", dims)

    def by_the_runtime() -> bytes:
        values = {f.name: attrgetter(f.source)(record) for f in fields}
        flat = {f.name: np.ravel(values[f.name]).tolist() for f in fields if f.shape}
        return CLASSES["Tick"](**values | flat).SerializeToString(deterministic=True)

    ranges = record.readings.ranges[0]
    scan = ScanMessage(1, np.linspace(0.0, 6.0, len(ranges)))
    message = LaserScan(frame_id="robot_1")

    def scan_by_the_runtime() -> bytes:
        set_timestamp(message, record.index)
        message.ranges[:] = ranges.tolist()
        return message.SerializeToString(deterministic=True)

    works = {
        "`/tick`, packed here": lambda: ours(record),
        "`/tick`, protobuf's classes": by_the_runtime,
        "a scan, packed here": lambda: scan.serialize(ranges, record.index),
        "a scan, protobuf's classes": scan_by_the_runtime,
    }
    print("\n| message | [us] |\n| --- | --- |")
    for name, time in each_in_turn(works, 500).items():
        print(f"| {name} | {time:.1f} |")


def read_here(data: bytes) -> Iterator[tuple[object, bytes]]:
    items = read_records(BytesIO(data[len(MAGIC) :]), len(data))
    for one in items:
        if not isinstance(one, Metadata):
            yield one.log_time if isinstance(one, LogMessage) else one.name, one.data


def read_by_mcap(data: bytes) -> Iterator[tuple[object, bytes]]:
    for one in StreamReader(BytesIO(data), validate_crcs=True).records:
        if isinstance(one, Message | Attachment):
            yield one.log_time if isinstance(one, Message) else one.name, one.data


def damaged(whole: bytes, rng: np.random.Generator) -> bytes:
    """Return the file with a bit turned, bytes replaced, a hole, or a cut."""
    start, length = int(rng.integers(len(MAGIC), len(whole))), int(10 ** rng.uniform(0, 4))
    turned = bytes([whole[start] ^ 1 << int(rng.integers(8))]) + whole[start + 1 : start + length]
    middle = (turned, rng.bytes(length), b"")
    kind = int(rng.integers(4))
    return whole[:start] + (middle[kind] + whole[start + length :] if kind < 3 else b"")


def reading(path: Path) -> None:
    whole = path.read_bytes()
    right, rng = list(read_here(whole)), np.random.default_rng(1)
    readers = {"read here": read_here, "mcap's StreamReader": read_by_mcap}
    ends = {name: Counter() for name in readers}
    for _ in range(ACCIDENTS):
        accident = damaged(whole, rng)
        for name, read in readers.items():
            found: list[tuple[object, bytes]] = []
            try:
                found.extend(read(accident))
            except Exception as error:
                ends[name][type(error).__name__] += 1
            ends[name]["wrong"] += found != right[: len(found)]
    times = each_in_turn({name: lambda read=read: list(read(whole)) for name, read in readers.items()}, 1)
    print(
        f"\n| reader | whole log [ms] | wrong data from {ACCIDENTS} damaged ones | raises |\n| --- | --- | --- | --- |"
    )
    for name, found in ends.items():
        raised = ", ".join(f"{error} {count}" for error, count in found.most_common() if error != "wrong")
        print(f"| {name} | {times[name] / 1e3:.0f} | {found['wrong']} | {raised} |")


def main() -> None:
    loaded = scenario("reference.solver=clarabel", "reference.period=0.01", "timing.duration=4")
    records = list(islice(Simulation.build(loaded.scenario).records(), 20))
    with tempfile.TemporaryDirectory() as folder:
        packing(records[-1])
        writers(loaded, Path(folder))
        reading(Path(folder) / next(iter(WRITERS)))


if __name__ == "__main__":
    sys.exit(main())
