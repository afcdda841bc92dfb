"""The variables of ROS decide which network interfaces are used: two machines as network namespaces, and a cable."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.association.scenes import known

SPEAKER = Path(__file__).parent / "speaker.py"
ROOT = Path(__file__).parent.parent.parent
MANY = 20  # messages
HOLD = "sysctl -qw net.ipv6.conf.all.disable_ipv6=1 && ip link set lo up && echo ready && cat"


@dataclass(frozen=True, slots=True)
class Machine:
    """A network namespace, held by a process."""

    holder: subprocess.Popen[str]

    def command(self, *words: str) -> list[str]:
        return ["nsenter", f"--net=/proc/{self.holder.pid}/ns/net", *words]

    @property
    def packets(self) -> int:
        """Return the number of packets that it has sent over the cable."""
        found = subprocess.run(self.command("ip", "-s", "-o", "link", "show", "cable"), capture_output=True, text=True)
        words = found.stdout.split()
        return int(words[words.index("TX:") + 9])  # after the header of seven words and the bytes


@pytest.fixture
def machines() -> Iterator[tuple[Machine, Machine]]:
    """Return two machines with a cable between them."""
    if os.geteuid() != 0 or any(shutil.which(tool) is None for tool in ("unshare", "nsenter", "ip", "sysctl")):
        pytest.skip("needs root, util-linux and iproute2")
    with ExitStack() as stack:
        both = []
        for _ in range(2):
            holder = subprocess.Popen(
                ["unshare", "--net", "sh", "-c", HOLD],
                stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
            )  # fmt: skip
            stack.enter_context(holder)
            stack.callback(holder.kill)
            if not holder.stdout or holder.stdout.readline() != "ready\n":
                pytest.skip("network namespaces are not allowed here")
            both.append(Machine(holder))
        first, second = both
        link = ["ip", "link", "add", "cable", "type", "veth", "peer", "cable", "netns", str(second.holder.pid)]
        if subprocess.run(first.command(*link), stderr=subprocess.DEVNULL, check=False).returncode:
            pytest.skip("virtual interfaces are not allowed here")
        for number, machine in enumerate(both, start=1):
            for words in (f"addr add 10.77.0.{number}/24 dev cable", "link set cable up"):
                subprocess.run(machine.command("ip", *words.split()), check=True)
        yield first, second


class Speakers:
    """Participants on a machine."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self._process = process
        self.heard: Counter[str] = Counter()

    def until(self, *wanted: str) -> None:
        """Read which names each receives until that is enough of those that are wanted."""
        while any(self.heard[line] < MANY for line in wanted):
            line = known(self._process.stdout).readline()
            assert line, "they have ended"
            self.heard[line.strip()] += 1


@contextmanager
def speakers(machine: Machine, **variables: dict[str, str]) -> Iterator[Speakers]:
    environment = {key: value for key, value in os.environ.items() if not key.startswith(("ROS_", "CYCLONEDDS_"))}
    paths = f"{ROOT}{os.pathsep}{os.environ.get('PYTHONPATH', '')}"
    with subprocess.Popen(
        machine.command(sys.executable, str(SPEAKER), json.dumps(variables)), env=environment | {"PYTHONPATH": paths},
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    ) as process:  # fmt: skip
        yield Speakers(process)
        known(process.stdin).close()
        known(process.stdout).read()  # until all have ended


ONLY, RANGE = {"ROS_LOCALHOST_ONLY": "1"}, {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
OFF = {"ROS_AUTOMATIC_DISCOVERY_RANGE": "OFF"}
SUBNET = {"ROS_LOCALHOST_ONLY": "0", "ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"}


def test_on_localhost_nothing_goes_over_another_interface(machines: tuple[Machine, Machine]) -> None:
    here, _ = machines
    before = here.packets
    with speakers(here, one=ONLY, other=RANGE) as both:
        both.until("one other", "other one")
    assert here.packets == before


@pytest.mark.long
def test_other_machines_find_what_is_for_them(machines: tuple[Machine, Machine]) -> None:
    here, there = machines
    with speakers(here, only=ONLY, range=RANGE, off=OFF, open={}) as ours, speakers(there, other=SUBNET) as theirs:
        ours.until("only only", "range range", "off off", "open other")
        theirs.until("other open")
        assert set(theirs.heard) <= {"other other", "other open"}
        assert {"open off", "only other", "range other", "off other"}.isdisjoint(ours.heard)
    assert here.packets > 0
