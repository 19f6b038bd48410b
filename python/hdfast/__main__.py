"""`python -m hdfast` is the command `hdfast`."""

import sys

from hdfast.cli import main

sys.exit(main())
