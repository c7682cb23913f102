"""`python -m softnlp` is the command `softnlp`."""

import sys

from softnlp.cli import main

sys.exit(main())
