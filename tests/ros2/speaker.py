"""Joins a domain as the node does, publishes its name until its input ends, and prints the names that it receives."""

from __future__ import annotations

import sys
import threading

from ros2 import domain_of
from ros2.connecting import connect
from ros2.messages import String
from ros2.wire import RELIABLE, Publisher, Subscription


def main(name: str) -> None:
    net = connect(domain_of({}))
    ended = threading.Event()

    def read() -> None:
        sys.stdin.read()
        ended.set()

    threading.Thread(target=read).start()
    publisher, subscription = Publisher(net, "names", String, RELIABLE), Subscription(net, "names", String, RELIABLE)
    print("ready", flush=True)
    while not ended.wait(0.05):
        publisher.publish(String(name))
        for message in subscription.take():
            print(message.data, flush=True)


main(sys.argv[1])
