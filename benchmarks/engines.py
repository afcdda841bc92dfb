"""Execution of long benchmarks: by processes of this machine, or on Ray."""

from __future__ import annotations

import argparse
import os

from batch import Engine, OnRay, Processes


def add_engine(parser: argparse.ArgumentParser) -> None:
    """Add the options that `engine_of` reads."""
    parser.add_argument("--processes", type=int, default=os.cpu_count() or 1, metavar="N", help="by default one a core")
    parser.add_argument("--ray", action="store_true", help="on Ray: on this machine, or on what RAY_ADDRESS names")


def engine_of(args: argparse.Namespace) -> Engine:
    """Return the engine that was asked for."""
    return OnRay() if args.ray else Processes(args.processes)
