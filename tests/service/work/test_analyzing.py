"""An analysis in turns at the gate."""

from __future__ import annotations

import numpy as np
import pytest

from association import CancelledError, Deadline, MapIndex
from map_quality import Analysis, Robot, standing_places
from registration import Segments
from service.work import analyzing
from service.work.analyzing import Tally, take_looks
from simulation import rectangle_room

BOX = np.array([[-2.5, -1.5, -2.5, 0.0], [-2.5, 0.0, -1.0, 0.0], [-1.0, 0.0, -1.0, -1.5], [-1.0, -1.5, -2.5, -1.5]])


@pytest.fixture
def tally() -> Tally:
    """Of a room in which no drive helps, and with a box that does."""
    room, robot = rectangle_room().segments, Robot(beams=180)
    standing = standing_places(room, robot, 2.5)
    analysis = Analysis(MapIndex.build(room, 0.0), room, robot, standing, drive=2.0)
    analysis = analysis.with_segments(Segments.from_array(BOX))
    return Tally(analysis, None, iter(standing.order.tolist()))


def test_others_have_their_turn_within_a_drive(tally: Tally, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(analyzing, "TURN_SECONDS", 0.0)
    turns, deadline = 1, Deadline()
    while take_looks(tally, deadline):
        turns += 1
    assert tally.done
    free = [one for one in tally.found.values() if one is not None]
    assert len(free) > 2
    assert turns > 4 * len(free)
    assert tally.found == {number: tally.analysis.look(number) for number in tally.found}
    assert any(one.with_landmark is not None and one.with_landmark.usable for one in free)


def test_who_hangs_up_within_a_drive_ends_it(tally: Tally, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(analyzing, "TURN_SECONDS", 0.0)
    deadline = Deadline()
    assert take_looks(tally, deadline)
    deadline.cancel()
    with pytest.raises(CancelledError):
        take_looks(tally, deadline)
    assert not tally.done
