"""The process of one robot: its program, fed by the world with measurements and by its neighbours with messages.

Rounds are kept in step by the messages themselves: every robot sends one to every neighbour in every round, an empty
one where its program says nothing, and goes on when all of the round have come. One that has not come after `timeout`
is missed; a neighbour that was missed is not waited for until it is heard in time again.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from time import monotonic, monotonic_ns
from typing import Any

from pbrg_mj.errors import PbrgError
from pbrg_mj.governor.messaging.networked import NetworkedGovernor
from pbrg_mj.governor.messaging.program import RobotFacts
from pbrg_mj.team.network import Network
from pbrg_mj.transport.address import Address
from pbrg_mj.transport.datagrams import (
    WORLD,
    Datagram,
    Kind,
    StartData,
    Traffic,
    answer_message,
    read_own,
    read_start,
)
from pbrg_mj.transport.mailbox import Mailbox

TIMEOUT = 10.0  # [s] for a message of a round
COMPILING = 300.0  # [s] for one of the first tick, in which kernels may be compiled
RETRY_PERIOD = 0.2  # [s] after which a greeting is repeated
CONNECT_TIMEOUT = 60.0  # [s] in which the world must answer it
ASKED = {Kind.READY: Kind.START, Kind.ANSWER: Kind.OWN}  # what each of these answers
WORLD_TIMEOUT = 300.0  # [s] of the world, after which it is taken to be gone: its kernels may be compiled
MOST_LATE = 1000  # rounds of earlier ticks whose messages are kept until the next one's
PARENT_POLL = 1.0  # [s] after which a robot that hears nothing asks whether it is still wanted


class RunOverError(Exception):
    """The world has said that the run is over."""


@dataclass
class RobotProcess:
    """One robot. `run` returns when the world says so."""

    governor: NetworkedGovernor
    network: Network
    robot: int  # from 0
    world: Address
    digest: bytes  # SHA-256 of the scenario
    wanted: Callable[[], bool] = lambda: True  # whether who started this process is still there
    timeout: float = TIMEOUT

    def __post_init__(self) -> None:
        """Know nothing yet; take a free port on the interface that leads to the world."""
        self.mailbox = Mailbox(host=self.world.local_host())
        self._facts = RobotFacts.of(self.network, self.robot, self.governor.constants)
        self._places: Mapping[int, Address] = {}
        self._messages: dict[tuple[int, int], dict[int, bytes]] = {}  # by tick and round, then sender
        self._now, self._traffic = (0, 0), Traffic()
        self._gone: set[int] = set()  # neighbours that are no more
        self._behind: set[int] = set()  # neighbours that were missed
        self._measured: Datagram | None = None
        self._expected = 0  # tick that is measured next
        self._last: Datagram | None = None  # what the world was sent last

    def run(self) -> None:
        """Greet the world, then answer every tick. Raises PbrgError when nobody answers or wants it any more."""
        try:
            given = self._connected()
            facts = self._facts._replace(start=given.start)
            memory = self.governor.program.start(facts, given.own)
            self._report(Kind.READY)
            while True:
                memory = self._tick(memory)
        except RunOverError:
            return
        except Exception as error:
            reason = " ".join(str(error).split())[:400] or type(error).__name__
            self._report(Kind.FAILED, body=reason.encode(errors="replace").decode())
            raise
        finally:
            self.mailbox.close()

    def _connected(self) -> StartData:
        greeted, until = -math.inf, monotonic() + CONNECT_TIMEOUT
        while (now := monotonic()) < until and self.wanted():
            if now - greeted >= RETRY_PERIOD:  # not for every answer, which may come at once
                self.mailbox.send(self.world, Datagram(Kind.HELLO, self.robot, body=self.digest))
                greeted = now
            came = self.mailbox.receive(greeted + RETRY_PERIOD - now)
            if came is None or came[1] != self.world:
                continue
            if came[0].kind is Kind.STOP:
                away = f"the world at {self.world} sends robot {self.robot + 1} away"
                raise PbrgError(f"{away}: another scenario, or the run is over")
            if came[0].kind is Kind.HELLO:
                until = now + WORLD_TIMEOUT  # it is there, and waits for others
            if came[0].kind is Kind.START:
                return self._started(came[0])
        raise PbrgError(f"no world answers at {self.world}, UDP")

    def _started(self, one: Datagram) -> StartData:
        with _from_the_world(one):
            given = read_start(one.body)
        if missing := {self.robot, *self._facts.neighbours} - set(given.places):
            raise PbrgError(f"the world does not tell robot {self.robot + 1} where robot {min(missing) + 1} is")
        self._places = given.places
        return given

    def _tick(self, memory: Any) -> Any:
        """Wait for a tick's measurements, run its rounds, answer."""
        program, measured = self.governor.program, self._next_measured()
        self._expected = measured.tick + 1
        with _from_the_world(measured):
            own = read_own(measured.tick, measured.body)
        memory = program.begin(own, memory)
        for k in range(self.governor.rounds):
            self._now = (measured.tick, k)
            outbox, memory = program.send(memory)
            self._send_messages(outbox)
            memory = program.receive(self._inbox(), memory)
        answer, memory = program.finish(memory)
        self._report(Kind.ANSWER, measured.tick, answer_message(answer, self._traffic))
        self._traffic = Traffic()
        return memory

    def _send_messages(self, outbox: Mapping[int, bytes]) -> None:
        """Send what the program says to each neighbour, and to the others that it says nothing."""
        tick, k = self._now
        if not_neighbours := set(outbox) - set(self._facts.neighbours):
            raise ValueError(f"robot {self.robot + 1} sends to robot {min(not_neighbours) + 1}, which is no neighbour")
        for neighbour in self._facts.neighbours:
            content = outbox.get(neighbour, b"")
            self.mailbox.send(self._places[neighbour], Datagram(Kind.MESSAGE, self.robot, tick, k, 0, content))
            self._traffic = self._traffic._replace(bytes_sent=self._traffic.bytes_sent + len(content))

    def _inbox(self) -> list[tuple[int, bytes]]:
        """Return what has come by this round, in the order of its sending, once all is there that is waited for."""
        until = monotonic() + (self.timeout if self._now[0] else max(self.timeout, COMPILING))
        while waiting := self._missing_neighbours():
            if (left := until - monotonic()) <= 0.0:
                self._behind |= waiting
                break
            self._take(min(left, PARENT_POLL))
        while self._take(0.0):
            pass
        heard = self._messages.get(self._now, {})
        missed = sum(one not in heard for one in self._facts.neighbours)
        self._traffic = self._traffic._replace(missed=self._traffic.missed + missed)
        due = sorted(key for key in self._messages if key <= self._now)
        messages = [message for key in due for message in sorted(self._messages.pop(key).items())]
        return [message for message in messages if message[1]]

    def _missing_neighbours(self) -> set[int]:
        heard = self._messages.get(self._now, {})
        return set(self._facts.neighbours) - self._gone - self._behind - set(heard)

    def _next_measured(self) -> Datagram:
        until = monotonic() + WORLD_TIMEOUT
        while self._measured is None:
            if not self._take(PARENT_POLL) and monotonic() > until:
                raise PbrgError(f"no message from the world for {WORLD_TIMEOUT:g} s")
        measured, self._measured = self._measured, None
        return measured

    def _take(self, timeout: float) -> bool:
        """Take in one datagram, if one comes; return whether one came."""
        came = self.mailbox.receive(timeout)
        if came is None:
            if timeout >= PARENT_POLL and not self.wanted():
                raise PbrgError("the world is gone")
            return False
        one, sender = came
        if one.kind is Kind.MESSAGE and self._places.get(one.robot) == sender:
            self._store(one)
        elif one.robot == WORLD and sender == self.world:
            self._handle(one)
        return True

    def _store(self, one: Datagram) -> None:
        key = (one.tick, one.round)
        if one.tick > self._expected or one.round >= self.governor.rounds:
            return  # nobody is ahead of the world
        if key not in self._messages and len(self._messages) >= MOST_LATE + self.governor.rounds:
            return
        now, shares_clock = monotonic_ns(), self._places[one.robot].host == self._places[self.robot].host
        timed = shares_clock and 0 < one.sent_ns <= now
        took = now - one.sent_ns if timed else 0
        self._messages.setdefault(key, {})[one.robot] = one.body
        if key >= self._now:
            self._behind.discard(one.robot)
        before = self._traffic
        self._traffic = before._replace(
            received=before.received + 1,
            timed=before.timed + timed,
            delay_sum_ns=before.delay_sum_ns + took,
            delay_max_ns=max(before.delay_max_ns, took),
        )

    def _handle(self, one: Datagram) -> None:
        if one.kind is Kind.STOP:
            raise RunOverError
        if one.kind is Kind.GONE:
            self._gone |= {one.body} & set(self._facts.neighbours)
        elif one.kind is Kind.OWN and one.tick == self._expected:
            self._measured = one
        elif self._last is not None and one.kind is ASKED.get(self._last.kind) and one.tick == self._last.tick:
            self.mailbox.send(self.world, self._last)  # it has not arrived

    def _report(self, kind: Kind, tick: int = 0, body: Any = None) -> None:
        self._last = Datagram(kind, self.robot, tick, body=body)
        self.mailbox.send(self.world, self._last)


@contextmanager
def _from_the_world(one: Datagram) -> Iterator[None]:
    """Raise PbrgError where a part of a message does not fit the others: the world may be other code."""
    try:
        yield
    except ValueError as error:
        raise PbrgError(f"what the world sends at tick {one.tick} is no {one.kind}: {error}") from None
