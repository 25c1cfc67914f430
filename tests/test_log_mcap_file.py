"""Our MCAP files against mcap's own Writer, byte for byte, over random sequences of calls."""

from __future__ import annotations

from io import BytesIO

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import Writer

from pbrg_mj.log.write import mcap_writer
from pbrg_mj.log.write.mcap_writer import McapWriter

NEVER = 2**62  # mcap's Writer ends no chunk by itself
CALLS = 120


@pytest.fixture(autouse=True)
def _same_compression(monkeypatch: pytest.MonkeyPatch) -> None:
    """mcap's Writer compresses at zstd's own level, whatever one wants."""
    monkeypatch.setattr(mcap_writer, "LEVEL", 3)


def theirs(output: BytesIO) -> Writer:
    writer = Writer(output, chunk_size=NEVER, enable_data_crcs=True)
    writer.start(profile="", library="pbrg_mj")
    return writer


def fill(writer: Writer | McapWriter, seed: int) -> None:
    """Do what the seed says, with times in any order, channels that come late, and flushes of nothing."""
    rng = np.random.default_rng(seed)
    schemas = [writer.register_schema("first", "jsonschema", b"{}")]
    channels = [writer.register_channel("/first", "json", schemas[0], {})]
    for call in rng.choice(7, CALLS, p=[0.7, 0.04, 0.06, 0.05, 0.05, 0.05, 0.05]).tolist():
        name, data = f"n\u00e4me {rng.integers(1000)}", rng.bytes(int(rng.integers(0, 300)))
        if call == 0:
            channel, sequence = int(rng.choice(channels)), int(rng.integers(2**32))
            writer.add_message(channel, int(rng.integers(2**62)), data, int(rng.integers(2**62)), sequence)
        elif call == 1:
            schemas.append(writer.register_schema(name, "jsonschema", data))
        elif call == 2:
            channels.append(writer.register_channel(name, "json", int(rng.choice(schemas)), {"key": name}))
        elif call == 3:
            writer.add_attachment(int(rng.integers(2**62)), int(rng.integers(2**62)), name, "text/plain", data)
        elif call == 4:
            writer.add_metadata(name, {"a": name, "b": ""})
        else:
            writer.flush()


@pytest.mark.parametrize("seed", range(30))
def test_files_are_those_of_mcap(seed: int) -> None:
    expected, written = BytesIO(), BytesIO()
    for writer in (theirs(expected), McapWriter(written)):
        fill(writer, seed)
        writer.finish()
    assert written.getvalue() == expected.getvalue()
    written.seek(0)
    summary = make_reader(written, validate_crcs=True).get_summary()
    assert summary is not None
    assert summary.statistics is not None
    assert summary.statistics.chunk_count > 1


def test_what_was_flushed_is_in_the_file() -> None:
    expected, written = BytesIO(), BytesIO()
    for writer in (theirs(expected), McapWriter(written)):
        fill(writer, 1)
        writer.flush()
    assert written.getvalue() == expected.getvalue()


def test_an_empty_file_is_that_of_mcap() -> None:
    expected, written = BytesIO(), BytesIO()
    for writer in (theirs(expected), McapWriter(written)):
        writer.finish()
    assert written.getvalue() == expected.getvalue()
