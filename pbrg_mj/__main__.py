"""`python -m pbrg_mj` is `pbrg`."""

import sys


def main() -> int:
    """Run the command line and return its exit code; Ctrl-C counts from the first import on."""
    try:
        from pbrg_mj.cli.main import main as command_line

        return command_line()
    except KeyboardInterrupt:
        return 130


if __name__ == "__main__":
    sys.exit(main())
