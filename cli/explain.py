"""``linefix explain``: how the verdict on an answer came about."""

from __future__ import annotations

from .contract import Json
from .errors import WrongUseError
from .locate import NearOptions, SearchChoice, request_body
from .options import AsJson, MapArgument, ScanArgument, UsableOptions, grouped
from .printing import pose_text, print_json, print_rows, print_table, verdict_rows

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
    from . import here

    body = request_body([on], scan, window, search, usable)
    if "maps" in body:
        raise WrongUseError(f"{on}: found a folder with {len(body['maps'])} maps, expected one map")
    found = here.explain(body)
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
        _print_model(one["model"])
        _print_taken(one["taken"])
        _print_alternatives(one)
        _print_null(one["null"])
    print("\nVetoes")
    print_table(
        ("veto", "origin", "result"),
        [(veto["name"], veto["origin"], "applies" if veto["applies"] else "passed") for veto in one["vetoes"]],
    )
    _print_probabilities(one)


def _print_model(model: Json) -> None:
    """Print the terms of the model, next to those of a usual right answer."""
    print("\nContributions to the log odds, nats")
    rows = [(term["name"], term["value"], term["nats"], term["usual"]) for term in model["contributions"]]
    rows.append(("sum", None, model["log_odds"], sum(term["usual"] for term in model["contributions"])))
    print_table(("feature", "value", "contribution", "usual"), rows)
    print(f"probability by the model and --on-map: {model['probability']:.4f}")


def _print_taken(taken: Json) -> None:
    print("\nDecrease of the log odds by reason, nats")
    print_table(("reason", "nats"), list(taken.items()))


def _print_alternatives(one: Json) -> None:
    """Print the alternatives with their weights, and the probability among them."""
    others, among = one["alternatives"], one["among_alternatives"]
    print(f"\nAlternatives: {len(others)}; the answer has weight 1")
    rows = [
        (pose_text(other["pose"]), round(other["gap"], 3) + 0.0, other["weight"])
        for other in others[:MOST_ALTERNATIVES]
    ]
    if rows:
        print_table(("pose", "gap in nats", "weight"), rows)
    loose = among["with_loose_walls"]
    compared = "not compared" if loose is None else f"{loose:.4f}"
    print(
        f"probability among them as scored: {among['as_scored']:.4f}; by what the scan shows: {among['by_shown']:.4f}; "
        f"with walls off by more: {compared}; weighted mean: {among['mean']:.4f}"
    )


def _print_null(null: Json | None) -> None:
    if null is None:
        print("\nNull score: not searched, because the answer is not usable without it")
        return
    if not null["score"]:
        print("\nNull score: the mirrored scan fits nowhere")
        return
    print(
        f"\nNull score: {null['score']:.1f} nats, {null['fraction']:.3f} of the answer's score; "
        f"symmetry of the map {null['symmetry']:.2f}"
    )


def _print_probabilities(one: Json) -> None:
    """Print the probabilities that decide next to their thresholds, and what follows."""
    if one["thresholds"] is not None:
        print("\nProbabilities")
        least = {"of the pose": one["thresholds"]["usable_from"], "explained": one["thresholds"]["explained"]}
        values = {"of the pose": one["probability_of_pose"], "explained": one["explained"]}
        rows = [
            (name, value, least[name], "reached" if value >= least[name] else "not reached")
            for name, value in values.items()
        ]
        print_table(("probability", "value", "threshold", "result"), rows)
    print(f"\nstatus {one['status']}, {'usable' if one['usable'] else 'not usable'}")
