"""The former name of `dataclass` for values that are made for each answer."""

from dataclasses import dataclass as value

__all__ = ["value"]
