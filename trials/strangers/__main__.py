"""`python -m trials.strangers`."""

import sys

from trials.strangers.run import main

if __name__ == "__main__":
    sys.exit(main())
