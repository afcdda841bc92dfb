"""The pages for people: a start page, and the contract to read and try, without the internet."""

from __future__ import annotations

import re
from base64 import b64encode
from functools import cache
from hashlib import sha256
from importlib.resources import files

from fastapi import APIRouter, Request
from fastapi.openapi.docs import get_swagger_ui_html
from fastapi.responses import HTMLResponse, Response

from ..errors import NotFoundError

router = APIRouter(include_in_schema=False)
ASSETS = {
    "swagger-ui-bundle.js": "text/javascript; charset=utf-8",
    "swagger-ui.css": "text/css; charset=utf-8",
    "favicon.png": "image/png",
}

_SCRIPT = re.compile(r"<script>(.*?)</script>", re.DOTALL)
_POLICY = (
    "default-src 'none'; script-src 'self' {scripts}; style-src 'self' 'unsafe-inline'; img-src 'self' data:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
START = """<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>Linefix</title>
<link rel="icon" href="/docs/assets/favicon.png">
<style>
  body { font: 16px/1.5 system-ui, sans-serif; max-width: 44rem; margin: 3rem auto; padding: 0 1rem; color: #1c2430 }
  code { background: #eef1f5; padding: .1em .3em; border-radius: .2em }
  a { color: #0b5fa5 }
</style>
<h1>Linefix</h1>
<p>Tells a robot where it is: it lays the line segments of a scan on those of a map, and says when it cannot.</p>
<ul>
  <li><a href="/docs">The endpoints</a>, to read and to try</li>
  <li><a href="/openapi.json">The contract</a> as OpenAPI</li>
  <li><a href="/v1/limits">Limits</a>, <a href="/version">version</a>, <a href="/readyz">readiness</a>,
    <a href="/metrics">metrics</a></li>
</ul>
</html>
"""


@cache
def _content(name: str) -> bytes:
    """Return a file of the page; once for all who read it, however slowly."""
    return files("fastapi_offline").joinpath("static", name).read_bytes()


@router.get("/", response_class=HTMLResponse)
async def start() -> HTMLResponse:
    """Point to what there is."""
    return _page(START)


@router.get("/openapi.json")
async def contract(request: Request) -> Response:
    """Give the contract; from bytes that all who read it share, however slowly."""
    return Response(await request.app.state.contract.body(), media_type="application/json")


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
    return _page(bytes(page.body).decode())


def _page(text: str) -> HTMLResponse:
    """Return a page that runs nothing but its own, and stands in no other."""
    scripts = " ".join(
        "'sha256-" + b64encode(sha256(script.encode()).digest()).decode() + "'" for script in _SCRIPT.findall(text)
    )
    policy = _POLICY.format(scripts=scripts)
    headers = {"Content-Security-Policy": policy, "X-Frame-Options": "DENY", "Referrer-Policy": "no-referrer"}
    return HTMLResponse(text, headers={**headers, "Cross-Origin-Opener-Policy": "same-origin"})


@router.get("/docs/assets/{name}")
async def asset(name: str) -> Response:
    """Give one of the page's files."""
    media_type = ASSETS.get(name)
    if media_type is None:
        raise NotFoundError("there is no such file")
    return Response(_content(name), media_type=media_type, headers={"Cache-Control": "public, max-age=86400"})
