"""``python -m service`` is ``linefix serve``."""

import sys

from .cli import serve

sys.exit(serve(sys.argv[1:]))
