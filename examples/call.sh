#!/bin/sh
# Asks a running service where a scan was taken; needs curl:  sh examples/call.sh http://127.0.0.1:8000
# A key, where the service wants one, in LINEFIX_KEY. The answer is JSON: gate on "usable".
url=${1:-http://127.0.0.1:8000}
set -- # what is left are the arguments of curl
if [ -n "$LINEFIX_KEY" ]; then set -- -H "Authorization: Bearer $LINEFIX_KEY"; fi
# An L-shaped room, and its walls as a robot sees them that stands at (1, 1) and looks along the map's y axis. Metres.
exec curl --silent --show-error --fail-with-body --max-time 60 --retry 3 "$@" -H 'Content-Type: application/json' \
  "$url/v1/associate" --data '{
    "map":  {"segments": [[0,0,6,0], [6,0,6,2], [6,2,4,2], [4,2,4,5], [4,5,0,5], [0,5,0,0]]},
    "scan": {"segments": [[-1,1,-1,-5], [-1,-5,1,-5], [1,-5,1,-3], [1,-3,4,-3], [4,-3,4,1], [4,1,-1,1]], "sigma": 0.02}}'
