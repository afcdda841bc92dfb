"""The README's request by a client that openapi-python-client made from the service's document: ``make clients``."""

import sys

from linefix_generated import Client
from linefix_generated.api.associate import associate
from linefix_generated.models import AssociateRequest

WALLS = [[0, 0, 6, 0], [6, 0, 6, 2], [6, 2, 4, 2], [4, 2, 4, 5], [4, 5, 0, 5], [0, 5, 0, 0]]
SEEN = [
    [-1.01, 0.99, -0.99, -4.98], [-1.00, -4.99, 0.98, -5.01], [1.01, -2.99, 3.98, -3.01], [4.01, -2.98, 3.99, 0.98],
    [1.60, -0.80, 1.20, -0.40],
]  # fmt: skip

asked = AssociateRequest.from_dict({"map": {"segments": WALLS}, "scan": {"segments": SEEN, "sigma": 0.02}})
answer = associate.sync(client=Client(base_url=sys.argv[1]), body=asked)
print(f"{answer.status} {str(answer.usable).lower()} {answer.pose.x:.3f}")
