"""The pages for people: a start page, and the contract to read and try, without the internet."""

from __future__ import annotations

import re
from base64 import b64encode
from hashlib import sha256
from importlib.resources import files
from os import stat_result
from typing import Any

from fastapi import APIRouter, Request
from fastapi.openapi.docs import get_swagger_ui_html
from fastapi.responses import HTMLResponse, Response
from fastapi.staticfiles import StaticFiles

from ..exchange import JSON, Admitted

router = APIRouter(include_in_schema=False)
_SCRIPT = re.compile(r"<script>(.*?)</script>", re.DOTALL)
_POLICY = (
    "default-src 'none'; script-src 'self'{scripts}; style-src 'self'{styles}; img-src 'self' data:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
_START = files("service.page").joinpath("built", "index.html").read_text()


class PageFiles(StaticFiles):
    """Files of the page, which a browser requests each time: a newer service has newer ones."""

    def lookup_path(self, path: str) -> tuple[str, stat_result | None]:
        """Find a file, but not the page itself, which has headers of its own."""
        return ("", None) if path in ("index.html", "manifest.json") else super().lookup_path(path)

    def file_response(self, *file: Any, **how: Any) -> Response:
        """Return a file, or that it is unchanged."""
        response = super().file_response(*file, **how)
        response.headers["Cache-Control"] = "no-cache"
        return response


router.mount("/page/examples", PageFiles(packages=[("service.page", "examples")]))
router.mount("/page", PageFiles(packages=[("service.page", "built")]))
router.mount("/docs/assets", StaticFiles(packages=[("fastapi_offline", "static")]))


@router.get("/", response_class=HTMLResponse)
async def start() -> HTMLResponse:
    """Give the page, which shows what the service does."""
    return _page(_START)


@router.get("/openapi.json")
async def contract(request: Request, exchange: Admitted) -> Response:
    """Give the contract; from bytes that all who read it share, however slowly."""
    document = await exchange.services.parse_threads.run(request.app.state.contract)
    return Response(document, media_type=JSON)


@router.get("/docs", response_class=HTMLResponse)
async def docs() -> HTMLResponse:
    """Show the contract with Swagger UI, whose files come from an installed package."""
    page = get_swagger_ui_html(
        openapi_url="/openapi.json",
        title="Linefix",
        swagger_js_url="/docs/assets/swagger-ui-bundle.js",
        swagger_css_url="/docs/assets/swagger-ui.css",
        swagger_favicon_url="/docs/assets/favicon.png",
    )
    return _page(bytes(page.body).decode(), styles=" 'unsafe-inline'")


def _page(text: str, styles: str = "") -> HTMLResponse:
    """Return a page that runs nothing but files next to it and its own scripts, and stands in no other."""
    digests = (b64encode(sha256(script.encode()).digest()).decode() for script in _SCRIPT.findall(text))
    policy = _POLICY.format(scripts="".join(f" 'sha256-{digest}'" for digest in digests), styles=styles)
    headers = {"Content-Security-Policy": policy, "X-Frame-Options": "DENY", "Referrer-Policy": "no-referrer"}
    return HTMLResponse(text, headers={**headers, "Cross-Origin-Opener-Policy": "same-origin"})
