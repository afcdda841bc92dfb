"""POST /v1/register: known correspondences."""

from __future__ import annotations

from functools import partial

from fastapi import APIRouter, Request, Response

from registration import Segments, register

from ...parsing.reading import read_model
from ...runtime import runtime_of
from ...schemas import examples
from ...schemas.replies import RegisterAnswer
from ...schemas.requests import RegisterRequest
from ...work.answers import registration_json
from ...work.inputs import measured_of, pairs_of, registration_options_of
from .answering import EVERYWHERE, READS_BODY, SEARCHES, json_response, problems, sealed, takes

router = APIRouter(tags=["register"])


@router.post(
    "/v1/register",
    response_model=RegisterAnswer,
    responses=problems(*EVERYWHERE, *READS_BODY, *SEARCHES),
    openapi_extra=takes(RegisterRequest, {"a corner": examples.REGISTER}),
    summary="Find the pose from known correspondences",
)
async def post_register(request: Request) -> Response:
    """Lay scan segments on the map segments that they are known to belong to."""
    runtime = runtime_of(request)
    runtime.require_ready(request)
    asked, watch = await runtime.read(request, partial(read_model, RegisterRequest))
    deadline = watch.deadline(None, runtime.settings.max_deadline_ms)

    def answer() -> bytes:
        map_segments = Segments.from_array(asked.map.segments, argument="map.segments")
        scan = measured_of(asked.scan)
        pairs = pairs_of(asked, len(map_segments), len(scan))
        options = registration_options_of(asked)
        watch.lap("decode")
        result = register(map_segments, scan, pairs, asked.map.sigma, options)
        watch.lap("search")
        return sealed(registration_json(result, pairs), request, watch)

    return json_response(await runtime.search(request, answer, deadline))
