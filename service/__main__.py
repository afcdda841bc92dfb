"""``python -m service`` is ``linefix serve``."""

import sys

from .serving import serve

sys.exit(serve(sys.argv[1:]))
