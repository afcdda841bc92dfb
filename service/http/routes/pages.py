"""The pages for people: a start page, and the contract to read and try, without the internet."""

from __future__ import annotations

import re
from base64 import b64encode
from collections.abc import Sequence
from functools import cache
from hashlib import sha256
from importlib.resources import files

from fastapi import APIRouter, Request
from fastapi.openapi.docs import get_swagger_ui_html
from fastapi.responses import HTMLResponse, Response

from ...errors import NotFoundError
from ..exchange import JSON, Admitted

router = APIRouter(include_in_schema=False)
_SCRIPT = re.compile(r"<script>(.*?)</script>", re.DOTALL)
_POLICY = (
    "default-src 'none'; script-src 'self' {scripts}; style-src 'self' 'unsafe-inline'; img-src 'self' data:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
# The page loads only files that lie next to it; it writes no markup of its own, so no style stands in any.
_PAGE_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
_REVALIDATED = "no-cache"  # a newer service has a newer page
_OWN = "service.page"
_KINDS = {
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".png": "image/png",
    ".json": JSON,
}
_NAME = re.compile(r"[a-z-]{1,40}(\.[a-z]{1,5})")


@cache
def _content(package: str, folder: str, name: str) -> bytes:
    """Return a file of a package; once for all who read it, however slowly."""
    found = files(package).joinpath(folder, name)
    if not found.is_file():
        raise NotFoundError("no file of the page has this name; load the page again")
    return found.read_bytes()


def _give(path: str, package: str, folder: str, cached: str, suffixes: Sequence[str]) -> None:
    """Add a route for those files of a folder that end so; any other name is that of no file."""

    @router.get(path + "/{name}")
    async def file(name: str) -> Response:
        found = _NAME.fullmatch(name)
        suffix = found[1] if found and found[1] in suffixes else ""
        content = _content(package, folder, name if suffix else "")
        return Response(content, media_type=_KINDS[suffix], headers={"Cache-Control": cached})


_give("/page/examples", _OWN, "examples", _REVALIDATED, [".json"])
_give("/page", _OWN, "built", _REVALIDATED, [".js", ".css"])
_give("/docs/assets", "fastapi_offline", "static", "public, max-age=86400", [".js", ".css", ".png"])


@router.get("/", response_class=HTMLResponse)
async def start() -> HTMLResponse:
    """Give the page, which shows what the service does."""
    return _page(_content(_OWN, "built", "index.html").decode(), _PAGE_POLICY)


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
    text = bytes(page.body).decode()
    scripts = " ".join(
        "'sha256-" + b64encode(sha256(script.encode()).digest()).decode() + "'" for script in _SCRIPT.findall(text)
    )
    return _page(text, _POLICY.format(scripts=scripts))


def _page(text: str, policy: str) -> HTMLResponse:
    """Return a page that runs nothing but its own, and stands in no other."""
    headers = {"Content-Security-Policy": policy, "X-Frame-Options": "DENY", "Referrer-Policy": "no-referrer"}
    return HTMLResponse(text, headers={**headers, "Cross-Origin-Opener-Policy": "same-origin"})
