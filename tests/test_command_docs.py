"""The page of all commands is whole, and says what they print."""

import subprocess
import sys
from pathlib import Path

import pytest

from pbrg_mj.cli.main import app

ROOT = Path(__file__).parents[1]
NAMES = [command.name for command in app.registered_commands]


@pytest.mark.parametrize("page", ["README.md", "docs/commands.md"])
@pytest.mark.parametrize("name", NAMES)
def test_every_command_is_shown(page, name):
    assert f"$ pbrg {name}" in (ROOT / page).read_text(encoding="utf-8")


@pytest.mark.slow
def test_commands_print_what_the_page_says():
    script = ROOT / "scripts" / "make_command_docs.py"
    done = subprocess.run([sys.executable, script, "--check"], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
