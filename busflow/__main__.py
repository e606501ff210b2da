"""`python -m busflow` is the `busflow` command."""

import sys

from busflow.cli import main

sys.exit(main())
