"""``python -m hwsim`` is the command ``hwsim``."""

import sys

from _hwsim import main

if __name__ == "__main__":
    sys.exit(main())
