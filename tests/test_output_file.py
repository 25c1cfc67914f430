"""What is half written: it goes with its process, or with the next file that is written beside it."""

import os
import signal

import pytest

from pbrg_mj.analysis.output_file import write_atomically, write_text_atomically
from pbrg_mj.errors import ShortageError


def killed_while_writing(place):
    """A process that writes to `place` is killed in the middle."""

    def be_killed(whole):
        whole.write_bytes(b"half")
        os.kill(os.getpid(), signal.SIGKILL)

    child = os.fork()
    if not child:
        write_atomically(place, be_killed)
    assert os.waitpid(child, 0)[1] == signal.SIGKILL


def test_what_a_killed_process_left_goes_when_the_next_file_is_written_beside_it(tmp_path):
    killed_while_writing(tmp_path / "run.npz")
    assert len(list(tmp_path.iterdir())) == 1
    write_text_atomically(tmp_path / "page.html", "whole")
    assert [one.name for one in tmp_path.iterdir()] == ["page.html"]


def test_what_a_living_process_writes_stays_and_so_does_what_is_no_file(tmp_path):
    (tmp_path / ".pbrg-folder").mkdir()
    os.mkfifo(tmp_path / ".pbrg-pipe")

    def write(whole):
        whole.write_text("first")
        write_text_atomically(tmp_path / "second.csv", "second")
        assert whole.read_text() == "first"

    write_atomically(tmp_path / "first.csv", write)
    assert (tmp_path / "first.csv").read_text() == "first"
    assert (tmp_path / "second.csv").read_text() == "second"
    assert len(list(tmp_path.iterdir())) == 4


def test_what_is_below_stays_for_who_writes_there(tmp_path):
    (tmp_path / "logs").mkdir()
    killed_while_writing(tmp_path / "logs" / "run.npz")
    write_text_atomically(tmp_path / "page.html", "whole")
    assert len(list((tmp_path / "logs").iterdir())) == 1


def test_a_failure_leaves_nothing(tmp_path):
    def fail(whole):
        whole.write_text("half")
        raise OSError(28, "No space left on device")

    with pytest.raises(ShortageError, match="cannot write: No space left on device"):
        write_atomically(tmp_path / "run.npz", fail)
    assert not list(tmp_path.iterdir())
