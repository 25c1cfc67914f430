"""`python -m pbrg_mj` is `pbrg`."""

import sys

from pbrg_mj.cli.main import main

if __name__ == "__main__":
    sys.exit(main())
