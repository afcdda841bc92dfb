"""POST /v1/vectorize: ranges or points to segments."""

from __future__ import annotations

from functools import partial

from fastapi import APIRouter, Request, Response

from vectorization import VectorizationOptions

from ...parsing.reading import read_model
from ...runtime import runtime_of
from ...schemas import examples
from ...schemas.replies import VectorizeAnswer
from ...schemas.requests import VectorizeRequest
from ...work.scanning import vectorize_laser, vectorize_points
from .answering import EVERYWHERE, READS_BODY, SEARCHES, json_response, problems, sealed, takes

router = APIRouter(tags=["vectorize"])


@router.post(
    "/v1/vectorize",
    response_model=VectorizeAnswer,
    responses=problems(*EVERYWHERE, *READS_BODY, *SEARCHES),
    openapi_extra=takes(VectorizeRequest, {"a corner": examples.VECTORIZE}),
    summary="Find the segments in ranges or points",
)
async def post_vectorize(request: Request) -> Response:
    """Cut a scan into directed segments, as /v1/associate does with a scan that comes as ranges or points."""
    runtime = runtime_of(request)
    runtime.require_ready(request)
    asked, watch = await runtime.read(request, partial(read_model, VectorizeRequest))
    deadline = watch.deadline(None, runtime.settings.max_deadline_ms)

    def answer() -> bytes:
        how = asked.options
        options = VectorizationOptions(how.sigma, how.min_points, how.min_length, how.max_gap)
        watch.lap("decode")
        places = ("", "/options")
        if asked.laser is not None:
            found = vectorize_laser(asked.laser, options, places)
        else:
            assert asked.points is not None  # the model takes exactly one of the two
            found = vectorize_points(asked.points, options, (0.0, 0.0), places)
        watch.lap("search")
        measured = found.measured
        segments = {
            "segments": measured.segments.endpoints.tolist(),
            "points": measured.points.astype(int).tolist(),
            "centroids": measured.centroids.tolist(),
            "spreads": measured.spreads.tolist(),
            "sigma": found.sigma,
            "sigmas": measured.sigma.tolist(),
            "rms": found.rms.tolist(),
        }
        return sealed(segments, request, watch)

    return json_response(await runtime.search(request, answer, deadline))
