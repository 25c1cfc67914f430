"""Run a log's scenario again and hold every message against the log, tick by tick."""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import zip_longest
from pathlib import Path

from google.protobuf.message import DecodeError, Message

from pbrg_mj.governor.registry import robot_programs
from pbrg_mj.log.read.header import LogHeader, open_mcap
from pbrg_mj.log.read.ticks import LoggedTicks
from pbrg_mj.log.schema import channels
from pbrg_mj.log.schema.ending import ending_text
from pbrg_mj.log.schema.message import NANOSECONDS, LogMessage
from pbrg_mj.log.schema.protobuf import absent_fields
from pbrg_mj.log.verify.difference import Difference, differences
from pbrg_mj.log.write.messages import MessageStream, dims_of
from pbrg_mj.log.write.provenance import CENTRALIZED, run_metadata, versions
from pbrg_mj.loop.record import TickRecord
from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.plugins import Objects

ABSENT = Difference("the message", "nothing", "a message", float("inf"))
UNEXPECTED = Difference("the message", "a message", "nothing", float("inf"))
# An event as 0.1.0 first worded it, and as it is worded since: the same event.
EARLIER_WORDS, WORDS = re.compile(r"(robot \d+) winds up"), r"\1: integrator wind-up"


@dataclass(frozen=True)
class Mismatch:
    """One place where log and replay differ."""

    channel: str  # or the name of what is embedded
    time: float  # [s]
    difference: Difference


@dataclass
class Verification:
    """What a replay found. `deviations` is filled only where log and replay ran in different environments."""

    environment_changes: dict[str, tuple[str, str]]  # what the numbers depend on and differs -> in the log, here
    duration: float  # of the scenario [s]
    ticks: int = 0  # compared
    messages: int = 0  # compared
    end: float = 0.0  # of the last tick compared [s]
    damage: str | None = None  # why the file ends early
    ended: str = ""  # why the log ends where it does
    first: Mismatch | None = None
    deviations: dict[tuple[str, str], Mismatch] = field(default_factory=dict)  # channel, field -> the largest

    @property
    def complete(self) -> bool:
        """Whether the log holds the scenario to its end."""
        return self.damage is None and self.end >= self.duration * (1 - 1e-12)

    def add(self, mismatch: Mismatch) -> None:
        """Take a mismatch into account: the first one, and the largest of its field."""
        self.first = self.first or mismatch
        key = (mismatch.channel, re.sub(r"\[\d+\]", "", mismatch.difference.field))
        largest = self.deviations.get(key)
        if largest is None or mismatch.difference.size > largest.difference.size:
            self.deviations[key] = mismatch

    @property
    def other_model(self) -> bool:
        """Whether the log comes from another environment, where robots or their world were modelled otherwise."""
        first = self.first
        return bool(self.environment_changes) and first is not None and first.channel == channels.MODEL_ATTACHMENT

    def within(self, tolerance: float) -> bool:
        """Tell whether no value differs by more than `tolerance`, in its own unit."""
        return all(one.difference.size <= tolerance for one in self.deviations.values())


def verify(
    path: Path,
    on_record: Callable[[TickRecord], object] = lambda _record: None,
    objects: Objects = Objects(),  # noqa: B008 - a frozen tuple
) -> Verification:
    """Run the log's scenario again and compare; `on_record` is called with every record of the replay.

    `objects` are the parts of a run that were objects.

    Ends at the first mismatch, unless the log comes from another environment: then what differs is gathered to the
    log's end. Of a run of another model no tick is compared. Raises InputError when the file is no log of this package
    or its scenario cannot be run here.
    """
    with open_mcap(path) as (file, size):
        logged = LoggedTicks(file, size, str(path))
        simulation = _simulation(logged.header, objects)
        found = Verification(_environment_changes(logged.header.versions), logged.header.scenario.timing.duration)
        _compare_models(found, logged.header.model_xml, simulation.model_xml)
        if found.first is None:
            _compare_ticks(found, logged, simulation, on_record)
        deque(logged, maxlen=0)  # the rest, unread: it may be damaged
        found.damage = logged.damage
        found.ended = ending_text(logged.ending, logged.passed, logged.header.scenario)
    return found


def _simulation(header: LogHeader, objects: Objects) -> Simulation:
    """Return the run again: of robots in processes of their own the same programs in this one, no message missed."""
    simulation = Simulation.build(header.scenario, objects)
    return (
        simulation.governed_by(robot_programs(header.scenario).with_ideal_network()) if header.processes else simulation
    )


def _environment_changes(logged: dict[str, str]) -> dict[str, tuple[str, str]]:
    here = versions()
    pairs = {name: (logged.get(name, "unknown"), here.get(name, "unknown")) for name in {**logged, **here}}
    return {name: pair for name, pair in pairs.items() if pair[0] != pair[1]}


def _compare_models(found: Verification, logged: str, composed: str) -> None:
    for line, (ours, theirs) in enumerate(zip_longest(logged.splitlines(), composed.splitlines()), start=1):
        if ours != theirs:
            values = ["nothing" if text is None else text.strip() for text in (ours, theirs)]
            difference = Difference(f"line {line}", values[0], values[1], float("inf"))
            found.add(Mismatch(channels.MODEL_ATTACHMENT, 0.0, difference))
            return
    if logged != composed:
        difference = Difference("line ends", repr(logged[-9:]), repr(composed[-9:]), float("inf"))
        found.add(Mismatch(channels.MODEL_ATTACHMENT, 0.0, difference))


def _compare_ticks(
    found: Verification, logged: LoggedTicks, simulation: Simulation, on_record: Callable[[TickRecord], object]
) -> None:
    stream: MessageStream | None = None
    absent, left_out = frozenset[str](), {channels.TIMING}
    for record in simulation.records():
        group = next(logged, None)
        if group is None:  # the log ends here
            return
        if stream is None:
            stream = MessageStream(logged.header.scenario, record)
            _compare_run_metadata(found, logged, record, simulation.centralized)
            absent = _absent_fields(group)
            if absent:  # there were fewer kinds of events, which repeat what the ticks say
                left_out.add(channels.EVENTS)
        group, expected = (
            [message for message in messages if message.topic not in left_out]
            for messages in (group, stream.messages(record))
        )
        _compare_tick(found, stream.types, group, expected, absent)
        found.ticks, found.messages, found.end = found.ticks + 1, found.messages + len(group), record.time
        on_record(record)
        if found.first is not None and not found.environment_changes:
            return
    if (beyond := next(logged, None)) is not None:
        found.add(Mismatch(beyond[0].topic, beyond[0].log_time / NANOSECONDS, UNEXPECTED))


def _compare_run_metadata(found: Verification, logged: LoggedTicks, first: TickRecord, centralized: bool) -> None:
    header = logged.header
    replayed = run_metadata(header.name, header.scenario.seed, dims_of(first), centralized, header.processes)
    for name, value in replayed.items():
        earlier = name == CENTRALIZED and name not in logged.run_metadata
        if not earlier and logged.run_metadata.get(name) != value:
            difference = Difference(name, str(logged.run_metadata.get(name)), value, float("inf"))
            found.add(Mismatch(channels.RUN_METADATA, 0.0, difference))


def _absent_fields(group: list[LogMessage]) -> frozenset[str]:
    """Return the fields of a tick that the log is too old to have."""
    ticks = [message.data for message in group if message.topic == channels.TICK]
    try:
        return absent_fields("Tick", ticks[0]) if ticks else frozenset()
    except DecodeError:  # which the comparison reports
        return frozenset()


def _compare_tick(
    found: Verification,
    types: dict[str, type[Message]],
    logged: list[LogMessage],
    replayed: list[LogMessage],
    absent: frozenset[str],
) -> None:
    """Compare message by message, in order; what one side alone has is a mismatch of its own.

    Fields in `absent` are left out.
    """
    left = list(replayed)
    for ours in logged:
        position = next((k for k, theirs in enumerate(left) if theirs.topic == ours.topic), None)
        # Missing before it: only where the rest of the tick cannot be paired any more.
        for theirs in left[: position or 0]:
            found.add(Mismatch(theirs.topic, theirs.log_time / NANOSECONDS, ABSENT))
        if position is None:
            found.add(Mismatch(ours.topic, ours.log_time / NANOSECONDS, UNEXPECTED))
            continue
        theirs, left = left[position], left[position + 1 :]
        for difference in _differences(types[ours.topic], ours, theirs):
            if difference.field.partition("[")[0] in absent:
                continue
            found.add(Mismatch(ours.topic, theirs.log_time / NANOSECONDS, difference))
    for theirs in left:
        found.add(Mismatch(theirs.topic, theirs.log_time / NANOSECONDS, ABSENT))


def _differences(kind: type[Message], logged: LogMessage, replayed: LogMessage) -> list[Difference]:
    found = [
        one
        for one in differences(kind, logged.data, replayed.data)
        if EARLIER_WORDS.sub(WORDS, one.logged) != one.replayed
    ]
    for name in ("log_time", "publish_time"):
        ours, theirs = getattr(logged, name), getattr(replayed, name)
        if ours != theirs:
            found.append(Difference(f"the message's {name}", str(ours), str(theirs), abs(ours - theirs) / NANOSECONDS))
    return found
