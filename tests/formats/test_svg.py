"""SVG as drawing programs write it: units, CSS, nested pictures, copies; hidden elements are no walls."""

from __future__ import annotations

from pathlib import Path

import pytest

from formats import ImportedMap, ImportOptions, MalformedFileError, TooLargeError, read_map

from .reading import counts, rows, svg, written

BASE = '<line x1="0" y1="0" x2="9" y2="0"/>'
OPTIONS = ImportOptions(units="m", drawn="faces")


def read(tmp_path: Path, inner: str, attributes: str = 'viewBox="0 0 40 20"') -> ImportedMap:
    return read_map(svg(tmp_path, inner, attributes), OPTIONS)


def lines(tmp_path: Path, inner: str, attributes: str = 'viewBox="0 0 40 20"') -> list[list[float]]:
    """Read the lines next to one that is always there; y as in the file."""
    found = [[x1, 0.0 - y1, x2, 0.0 - y2] for x1, y1, x2, y2 in rows(read(tmp_path, inner + BASE, attributes))]
    found.remove([0, 0, 9, 0])
    return found


@pytest.mark.parametrize(
    ("told", "expected"),
    [
        ("50%", 20.0), ("96px", 96.0), ("1in", 96.0), ("2.54cm", 96.0), ("25.4mm", 96.0), ("72pt", 96.0), ("6pc", 96.0),
        (" 1.5e1 ", 15.0), ("+.5IN", 48.0),
    ],
)  # fmt: skip
def test_lengths(tmp_path: Path, told: str, expected: float) -> None:
    assert lines(tmp_path, f'<line x1="1" y1="2" x2="{told}" y2="2"/>') == [[1, 2, expected, 2]]


def test_percentages_are_of_width_or_height(tmp_path: Path) -> None:
    inner = '<line x1="10%" y1="10%" x2="90%" y2="90%"/>'
    assert lines(tmp_path, inner) == [[4, 2, 36, 18]]
    assert lines(tmp_path, inner, 'width="200" height="100"') == [[20, 10, 180, 90]]
    nested = "<svg x='1' width='10' height='4'><line x1='0' y1='50%' x2='100%' y2='50%'/></svg>"
    assert lines(tmp_path, nested) == [[1, 2, 11, 2]]
    with pytest.raises(MalformedFileError, match=r"line 2: x1 of a line element is '10%'.*neither viewBox nor width"):
        lines(tmp_path, inner, "")


@pytest.mark.parametrize("told", ["2em", "1furlong", "1 2", "--1", "50 %%", "calc(1px)"])
def test_what_is_no_length_is_named_with_its_line(tmp_path: Path, told: str) -> None:
    with pytest.raises(MalformedFileError, match=r"line 3: width of a rect element is '.*', expected a number"):
        read(tmp_path, f'\n<rect x="1" y="1" width="{told}" height="2"/>')


@pytest.mark.parametrize(
    "points", ["1,1 2,1-3,4", "1 1,2 1 -3 4", "1,1,2,1,-3,4", "1.0.1e1,2,1-3+4", " 1,1\n2,1\t-3,4 "]
)
def test_lists_of_numbers(tmp_path: Path, points: str) -> None:
    assert len(lines(tmp_path, f'<polyline points="{points}"/>')) == 2


@pytest.mark.parametrize(
    ("inner", "message"),
    [
        ('<polyline points="1,1 2,x5"/>', "line 2: points of a polyline element is 'x5'"),
        (f'<g style="transform: translate(calc(1px + 1px), 0)">{BASE}</g>', r"calc\(1px \+ 1px\)"),
        ('<path d="M0 0H4 what"/>', "d of a path element"),
    ],
)
def test_what_is_not_read_is_named(tmp_path: Path, inner: str, message: str) -> None:
    with pytest.raises(MalformedFileError, match=message):
        read(tmp_path, inner)


INLINE = '<rect style="display:inline" x="1" y="1" width="2" height="3"/>'
HIDDEN = '<rect x="1" y="1" width="2" height="3"/>'


@pytest.mark.parametrize(
    "inner",
    [
        f"<style>.st0{{display:none;}}</style><g class='a st0 b'>{HIDDEN}</g>",
        f"<style>#away {{ display : NONE }}</style><g id='away'>{HIDDEN}</g>",
        f"<style>rect {{ visibility: hidden }}</style>{HIDDEN}",
        f"<style><![CDATA[ /* gone */ g.x > rect, .y {{display:none}} ]]></style><g class='x'>{HIDDEN}</g>",
        f"<style>.x {{display:none !important}}</style><g class='x' style='display:inline'>{HIDDEN}</g>",
        f"<g display='none'>{HIDDEN}</g>",
        f"<g style='fill:red;display: none'>{HIDDEN}</g>",
        f"<g visibility='hidden'><g>{HIDDEN}</g></g>",
        f"<g style='visibility:collapse'>{HIDDEN}</g>",
        f"<g opacity='0'>{HIDDEN}</g>",
        f"<g style='opacity:0.0'>{HIDDEN}</g>",
        f"<svg display='none'>{HIDDEN}</svg>",
        f"<svg width='0' height='5'>{HIDDEN}</svg>",
        "<rect x='1' y='1' width='2' height='3' fill='none' stroke='none'/>",
        "<g fill='none'><rect x='1' y='1' width='2' height='3' style='stroke:transparent'/></g>",
        "<g stroke-opacity='0'><line x1='1' y1='1' x2='5' y2='5'/></g>",
        "<g stroke-opacity='0'><line stroke='red' x1='1' y1='1' x2='5' y2='5'/></g>",
        "<g stroke='none'><line x1='1' y1='1' x2='5' y2='5'/></g>",
        "<rect width='100%' height='100%' fill='white'/>",
        "<rect x='0' y='0' width='40' height='20' style='fill:#fff;stroke:none'/>",
        f"<switch><g systemLanguage='de'>{HIDDEN}</g></switch>",
    ],
)
def test_hidden_elements(tmp_path: Path, inner: str) -> None:
    assert lines(tmp_path, inner) == []
    found = counts(read(tmp_path, inner + BASE))
    assert {"hidden", "not_painted", "background"} & found.keys() or "switch" in inner


@pytest.mark.parametrize("kind", ["defs", "symbol", "clipPath", "mask", "pattern", "marker", "metadata"])
def test_definitions_are_not_drawn(tmp_path: Path, kind: str) -> None:
    assert lines(tmp_path, f"<{kind} id='d'>{HIDDEN}</{kind}>") == []


@pytest.mark.parametrize(
    "inner",
    [
        f"<g visibility='hidden'><g style='visibility:visible'>{HIDDEN}</g></g>",
        f"<style>.a {{display:none}} .b.a {{display:block}}</style><g class='a b'>{HIDDEN}</g>",
        f"<style>.a:hover {{display:none}} @media print {{ rect {{display:none}} }} %$ {{}} </style>{HIDDEN}",
        f"<style>rect {{display:none}}</style><g>{INLINE}</g>",
        f"<switch><foreignObject requiredExtensions='x'/><g>{HIDDEN}</g><g>{HIDDEN}</g></switch>",
        "<rect x='1' y='1' width='2' height='3' fill='none' stroke='black'/>",
        "<rect x='1' y='1' width='2' height='3' fill='grey' stroke='none'/>",
        "<g stroke-opacity='0' fill='none'><path d='M1 1H3V4H1Z' stroke-opacity='1' stroke='black'/></g>",
        "<g stroke='black' stroke-opacity='0' fill='none'><path d='M1 1H3V4H1Z' stroke-opacity='1'/></g>",
        "<rect width='40' height='20' fill='white' stroke='black'/>",  # all of the picture
        "<rect width='40' height='20'/>",
    ],
)
def test_shown_elements(tmp_path: Path, inner: str) -> None:
    assert len(lines(tmp_path, inner)) == 4


ONE = '<line x1="0" y1="0" x2="10" y2="5"/>'


@pytest.mark.parametrize(
    ("attributes", "expected"),
    [
        ("", [0, 0, 10, 5]),
        ("x='2' y='1'", [2, 1, 12, 6]),
        ("x='2' y='1' width='20' height='10' viewBox='0 0 10 5'", [2, 1, 22, 11]),
        ("width='50%' height='100%' viewBox='0 0 10 5'", [0, 5, 20, 15]),
        ("width='20' height='20' viewBox='0 0 10 5' preserveAspectRatio='xMinYMax meet'", [0, 10, 20, 20]),
        ("width='20' height='20' viewBox='0 0 10 5' preserveAspectRatio='none'", [0, 0, 20, 20]),
        ("width='20' height='20' viewBox='0 0 10 5' preserveAspectRatio='xMidYMid slice'", [-10, 0, 30, 20]),
        ("viewBox='-10 -5 20 10'", [20, 10, 40, 20]),
    ],
)
def test_nested_pictures(tmp_path: Path, attributes: str, expected: list[float]) -> None:
    assert lines(tmp_path, f"<svg {attributes}>{ONE}</svg>") == [expected]
    moved = lines(tmp_path, f"<g transform='translate(100 7)'><svg {attributes}>{ONE}</svg></g>")
    assert moved == [[expected[0] + 100, expected[1] + 7, expected[2] + 100, expected[3] + 7]]


@pytest.mark.parametrize(
    ("use", "expected"),
    [
        ("<use href='#one'/>", [[0, 0, 10, 5]]),
        ("<use xlink:href='#one' x='3' y='4'/>", [[3, 4, 13, 9]]),
        ("<use href='#one' x='1' transform='scale(2)'/>", [[2, 0, 22, 10]]),
        ("<use href='#group'/>", [[5, 0, 15, 5]]),
        ("<use href='#two'/>", [[5, 0, 15, 5], [6, 1, 16, 6]]),
        ("<use href='#sign' width='20' height='10'/>", [[0, 0, 20, 10]]),
        ("<use href='#sign' x='2' width='20' height='20'/>", [[2, 5, 22, 15]]),
        ("<use href='#one' visibility='hidden'/>", []),
        ("<use href='#nothing'/>", []),
        ("<use href='other.svg#one'/>", []),
        ("<use href='#loop'/>", []),
        ("<use/>", []),
    ],
)
def test_copies(tmp_path: Path, use: str, expected: list[list[float]]) -> None:
    defs = (
        f"<defs><line id='one' x2='10' y2='5'/><g id='group' transform='translate(5)'>{ONE}</g>"
        "<g id='two'><use href='#group'/><use href='#group' x='1' y='1'/></g>"
        f"<symbol id='sign' viewBox='0 0 10 5'>{ONE}</symbol><g id='loop'><g><use href='#loop'/></g></g></defs>"
    )
    assert sorted(lines(tmp_path, defs + use)) == expected


def test_copies_of_copies_are_bounded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("formats.drawings.svg.xml.MAX_ENTITIES", 5_000)
    levels = "".join(f"<g id='g{k}'>" + f"<use href='#g{k + 1}'/>" * 10 + "</g>" for k in range(8))
    with pytest.raises(TooLargeError, match="copies by use included"):
        read(tmp_path, f"<defs>{levels}<g id='g8'>{ONE}</g></defs><use href='#g0'/>")
    deep = "".join(f"<g id='g{k}'><use href='#g{k + 1}'/></g>" for k in range(70))
    with pytest.raises(TooLargeError, match="in one another"):
        read(tmp_path, f"<defs>{deep}</defs><use href='#g0'/>")


def test_what_is_left_out_is_counts(tmp_path: Path) -> None:
    inner = f"<g display='none'>{HIDDEN}{ONE}</g><text/><circle r='2'/><circle r='3'/><g clip-path='url(#c)'>{ONE}</g>"
    found = counts(read(tmp_path, inner))
    assert (found["hidden"], found["entity_circle"], found["entity_text"], found["clipped"]) == (2, 2, 1, 1)


@pytest.mark.parametrize(
    ("attributes", "expected"),
    [
        ("transform='rotate(90)' transform-origin='3 -2'", [1, -5, -4, 5]),
        ("style='transform: rotate(0.25turn); transform-origin: 3px -2px'", [1, -5, -4, 5]),
        ("style='transform: scale(0.5); transform-origin: center'", [10, 5, 15, 7.5]),
        ("style='transform: scale(0.5); transform-origin: bottom right'", [20, 10, 25, 12.5]),
        ("style='transform: scale(0.5); transform-origin: 50% top'", [10, 0, 15, 2.5]),
        ("style='transform: translate3d(1px, 10%, 0) scale3d(2, 2, 1)'", [1, 2, 21, 12]),
        ("style='transform: translateY(10%) rotateZ(90deg)'", [0, 2, -5, 12]),
        ("style='transform: matrix3d(1,0,0,0, 0,1,0,0, 0,0,1,0, 4,5,0,1)'", [4, 5, 14, 10]),
        ("style='rotate: 90deg; translate: 1px 2px; scale: 2'", [1, 2, -9, 22]),
        ("style='rotate: z 90deg'", [0, 0, -5, 10]),
        ("style='rotate: x 45deg; transform: none' rotate='90'", [0, 0, 10, 5]),
        ("style='scale: 50%'", [0, 0, 5, 2.5]),
        ("class='on screen'", [1, 0, 11, 5]),
        ("class='in print'", [0, 0, 10, 5]),
    ],
)
def test_transforms(tmp_path: Path, attributes: str, expected: list[float]) -> None:
    move = "{ transform: translate(1px, 0) }"
    style = f"<style>@media screen{{.screen {move}}} @media print{{.print {move}}}</style>"
    ((x1, y1, x2, y2),) = lines(tmp_path, f"{style}<g {attributes}>{ONE}</g>")
    assert [x1, y1, x2, y2] == pytest.approx(expected, abs=1e-6)


def test_transforms_of_css(tmp_path: Path) -> None:
    turned = f"<g style='transform: rotateX(9deg)'>{ONE}</g>"
    boxed = f"<g style='transform: scale(1); transform-origin: 0% 0%; transform-box: fill-box'>{ONE}</g>"
    assert counts(read(tmp_path, turned + boxed), "dropped", "assumed") == {
        "transform": 1,
        "transform_box": 1,
        "directions": 0,
    }


BODY = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 9 9">{ONE}</svg>'


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16", "iso-8859-1", "windows-1252", "us-ascii"])
def test_encodings(tmp_path: Path, encoding: str) -> None:
    text = f'<?xml version="1.0" encoding="{encoding}"?>\n{BODY}'
    assert len(read_map(written(tmp_path, "plan.svg", text.encode(encoding)), OPTIONS).map.segments) == 1


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b'<?xml version="1.0" encoding="unknown-enc"?>' + BODY.encode(), "unknown encoding"),
        (b'<?xml version="1.0" encoding="shift_jis"?>' + BODY.encode(), "UTF-8|is not XML"),
        (b'<?xml version="1.0" encoding="zlib"?>' + BODY.encode(), "UTF-8|is not XML"),
        (b'<?xml version="1.0" encoding="utf-16"?>' + BODY.encode(), "is not XML"),
        (BODY.encode("utf-32"), "is not XML"),
        (b"\x00" * 100, "is not XML"),
        (BODY.encode()[:-5], "is not XML from line 1 on"),
        (b'<!DOCTYPE svg [<!ATTLIST svg a CDATA "' + b"x" * 1000 + b'">]>' + BODY.encode(), "declares"),
    ],
)
def test_files_that_are_no_xml(tmp_path: Path, content: bytes, message: str) -> None:
    with pytest.raises(MalformedFileError) as caught:
        read_map(written(tmp_path, "plan.svg", content), OPTIONS)
    assert any(part in str(caught.value) for part in message.split("|"))


def test_one_tag_of_many_megabytes(tmp_path: Path) -> None:
    attributes = " ".join(f'a{k:07d}=""' for k in range(1_500_000))
    with pytest.raises(TooLargeError, match="expected elements of at most"):
        read_map(written(tmp_path, "plan.svg", f"<svg {attributes}/>"), OPTIONS)
