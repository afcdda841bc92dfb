"""Request documents to what `linefix` takes: the part of the service that the command line checks its files with.

It loads neither HTTP nor a database. An error that rejects a document names its place by a JSON pointer.
"""

from __future__ import annotations

from linefix.documents.encoding import encode
from linefix.documents.errors import Fault, InvalidRequestError, TooManyError
from linefix.documents.limits import Limits
from linefix.documents.parts import InlineMap, StoredMap, is_oriented
from linefix.documents.requests import AssociateRequest, CheckRequest, RegisterRequest, VectorizeRequest

from .parsing.errors import NotJsonError
from .parsing.reading import parse, validate
from .work.inputs import association_options_of, fault_of, included_of, prior_of, scanned_of, scans_of
from .work.job import Stopwatch
from .work.registration import KnownPairs
from .work.scans import vectorization_of

__all__ = [
    "AssociateRequest",
    "CheckRequest",
    "Fault",
    "InlineMap",
    "InvalidRequestError",
    "KnownPairs",
    "Limits",
    "NotJsonError",
    "RegisterRequest",
    "Stopwatch",
    "StoredMap",
    "TooManyError",
    "VectorizeRequest",
    "association_options_of",
    "encode",
    "fault_of",
    "included_of",
    "is_oriented",
    "parse",
    "prior_of",
    "scanned_of",
    "scans_of",
    "validate",
    "vectorization_of",
]
