"""Joins a domain as the node does, once for each name and its variables, each time in a process of its own.

Each publishes its name until its input ends, and prints its name next to those that it receives.
"""

from __future__ import annotations

import json
import os
import sys
import threading

from ros2 import domain_of
from ros2.connecting import connect
from ros2.messages import String
from ros2.topics import RELIABLE, Publisher, Subscription


def speak(name: str) -> None:
    net = connect(domain_of({}))
    ended = threading.Event()

    def read() -> None:
        sys.stdin.read()
        ended.set()

    threading.Thread(target=read).start()
    publisher, subscription = Publisher(net, "names", String, RELIABLE), Subscription(net, "names", String, RELIABLE)
    while not ended.wait(0.05):
        publisher.publish(String(name))
        for message in subscription.take():
            # print() writes word after word if Python does not buffer: lines of two processes would mix.
            sys.stdout.write(f"{name} {message.data}\n")
            sys.stdout.flush()


for name, variables in json.loads(sys.argv[1]).items():
    if os.fork() == 0:
        os.environ.update(variables)
        speak(name)
        sys.exit()
