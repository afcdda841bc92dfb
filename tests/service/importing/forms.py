"""Forms with files, as a browser or curl sends them."""

from __future__ import annotations

import io

from PIL import Image

BOUNDARY = "3d6b"
TYPE = f"multipart/form-data; boundary={BOUNDARY}"
SQUARE = b"x1,y1,x2,y2\n0,0,4,0\n4,0,4,3\n4,3,0,3\n0,3,0,0\n"
YAML = b"image: %b\nresolution: 0.05\norigin: [-1.0, -2.0, 0.0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"


def form(files: dict[str, bytes], *fields: tuple[str, str]) -> bytearray:
    parts = [(f'name="{name}"', value.encode()) for name, value in fields]
    parts += [(f'name="file"; filename="{name}"', content) for name, content in files.items()]
    lines = (
        f"--{BOUNDARY}\r\nContent-Disposition: form-data; {told}\r\n\r\n".encode() + c + b"\r\n" for told, c in parts
    )
    return bytearray(b"".join(lines) + f"--{BOUNDARY}--\r\n".encode())


def room_grid() -> dict[str, bytes]:
    """A room of 8 by 5 m with a pillar, as map_server keeps it."""
    picture = Image.new("L", (200, 140), 205)
    picture.paste(0, (16, 16, 184, 124))
    picture.paste(254, (20, 20, 180, 120))
    picture.paste(0, (60, 50, 80, 70))
    return {"room.yaml": YAML % b"room.pgm", "room.pgm": encoded(picture, "PPM")}


def encoded(picture: Image.Image, kind: str) -> bytes:
    content = io.BytesIO()
    picture.save(content, kind)
    return content.getvalue()
