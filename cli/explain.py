"""``linefix explain``: how the verdict on an answer came about."""

from __future__ import annotations

from .asking import answering, id_of
from .errors import Asked, WrongUseError
from .locate import NearOptions, SearchChoice, request_body
from .options import AsJson, MapArgument, ScanArgument, UsableOptions, grouped
from .printing import Json, pose_text, print_json, print_rows, print_table, verdict_rows

MOST_ALTERNATIVES = 10  # that people read; --json has all


@grouped
def explain(
    on: MapArgument,
    scan: ScanArgument,
    window: NearOptions,
    search: SearchChoice,
    usable: UsableOptions,
    as_json: AsJson = False,
) -> None:
    """Show how the verdict on a scan came about: features, alternatives, null score, vetoes, probabilities.

    The answer is that of linefix locate. It is usable if its probability reaches --usable-from and no veto applies.
    """
    body = request_body([on], scan, window, search, usable)
    if "maps" in body:
        raise WrongUseError(f"{on}: found a folder with {len(body['maps'])} maps, expected one map")
    with answering(Asked(id_of(body["map"]))) as within:
        from linefix import answering as library

        found = library.explain(body, within)
    if as_json:
        print_json(found)
        return
    print_rows(verdict_rows(found["answer"]))
    _print_verdict(found["verdict"])
    if found["last_view"] is not None:
        print("\nThe last view of the drive alone:")
        _print_verdict(found["last_view"])


def _print_verdict(one: Json) -> None:
    """Print a verdict, part by part."""
    if one["features"] is not None:
        for against in one["log_odds"]:
            _print_odds(one, against)
        print("\nIncrease of the log odds if the features of a reason were usual, nats")
        print_table(("reason", "nats"), list(one["taken"].items()))
        _print_alternatives(one)
        _print_null(one["null"])
    print("\nVetoes")
    print_table(
        ("veto", "reason", "result"),
        [(veto["name"], veto["reason"], "applies" if veto["applies"] else "passed") for veto in one["vetoes"]],
    )
    _print_probabilities(one)


def _print_odds(one: Json, against: str) -> None:
    """Print the terms of the odds against one way of being not right, next to those of a usual right answer."""
    print(f"\nContributions to the log odds against {against}, nats")
    terms = [term for term in one["contributions"] if term["against"] == against]
    rows = [(term["name"], term["value"], term["nats"], term["usual"]) for term in terms]
    print_table(("feature", "value", "contribution", "usual"), rows)
    print(f"log odds with the constant: {one['log_odds'][against]:.3f}")


def _print_alternatives(one: Json) -> None:
    """Print the alternatives with their weights, and the probability among them."""
    others = one["alternatives"]
    print(f"\nAlternatives: {len(others)}; the answer has weight 1")
    rows = [
        (pose_text(other["pose"]), round(other["gap"], 3) + 0.0, other["weight"])
        for other in others[:MOST_ALTERNATIVES]
    ]
    if rows:
        print_table(("pose", "gap in nats", "weight"), rows)


def _print_null(null: Json | None) -> None:
    if null is None:
        print("\nNull score: not searched, because the answer is not usable without it")
        return
    if not null["score"]:
        print("\nNull score: the mirrored scan fits nowhere")
        return
    print(f"\nNull score: {null['score']:.1f} nats, {null['fraction']:.3f} of the answer's score")


def _print_probabilities(one: Json) -> None:
    """Print the probabilities, their thresholds, and what follows."""
    if one["features"] is not None:
        least = one["thresholds"]
        print(f"\nProbabilities, with the prior probability {least['on_map']:.2f} of the map")
        rows = [
            ("by the model", one["by_model"], None),
            ("among the alternatives", one["among"], None),
            ("of the pose, their product", one["by_model"] * one["among"], least["usable_from"]),
            ("explained", one["explained"], least["explained"]),
        ]
        print_table(("probability", "value", "threshold"), rows)
    print(f"\nstatus {one['status']}, {'usable' if one['usable'] else 'not usable'}")
