"""The register of all families of buildings."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from .cubicles import Cubicles
from .dormitory import Dormitory
from .facades import Facades
from .factory import Factory
from .flats import Apartments, MirroredFlats
from .garage import Garage
from .hospital import Hospital
from .hotel import Hotel
from .mine import Mine
from .museum import Museum
from .office_floors import OfficeFloors
from .plan import Building
from .round_rooms import RoundRooms
from .school import School
from .supermarket import Supermarket
from .terraces import Terraces
from .warehouse import RackLegs, Warehouse


class Style(Protocol):
    """Properties that buildings of one owner share: dimensions, but not counts and places."""

    def build(self, rng: np.random.Generator) -> Building:
        """Draw one building."""


class Draw(Protocol):
    """The distribution of the styles of a family."""

    def __call__(self, rng: np.random.Generator) -> Style:
        """Draw a style."""


@dataclass(frozen=True, slots=True)
class Family:
    """A kind of building.

    Attributes
    ----------
    what : str
        One line for a reader.
    draw : callable
        Takes a `numpy.random.Generator`, returns a style, whose `build` draws buildings: sisters, where it is called
        more than once.
    held_out : bool
        True if buildings of this kind serve to report figures alone: nothing is fitted or tuned on them.
    """

    what: str
    draw: Draw
    held_out: bool


FAMILIES: dict[str, Family] = {
    "warehouse": Family("racks full of goods", Warehouse.draw, held_out=False),
    "rack_legs": Family("racks of which only the legs are seen", RackLegs.draw, held_out=True),
    "garage": Family("columns and parked cars", Garage.draw, held_out=False),
    "hospital": Family("wards of equal rooms with beds", Hospital.draw, held_out=False),
    "hotel": Family("a corridor of mirrored rooms", Hotel.draw, held_out=True),
    "cubicles": Family("an open-plan office", Cubicles.draw, held_out=True),
    "factory": Family("a hall of machines", Factory.draw, held_out=False),
    "mine": Family("rough tunnels between pillars", Mine.draw, held_out=True),
    "supermarket": Family("rows of shelves and checkouts", Supermarket.draw, held_out=True),
    "facades": Family("a street between houses", Facades.draw, held_out=True),
    "mirrored_flats": Family("one flat and its mirror image, repeated", MirroredFlats.draw, held_out=True),
    "round_rooms": Family("rotundas and chapels", RoundRooms.draw, held_out=False),
    "school": Family("classrooms full of tables", School.draw, held_out=False),
    "museum": Family("galleries in a line", Museum.draw, held_out=True),
    "offices": Family("rooms on both sides of corridors", OfficeFloors.draw, held_out=False),
    "apartments": Family("flats of which no two are alike", Apartments.draw, held_out=False),
    "dormitory": Family("a corridor of equal rooms", Dormitory.draw, held_out=False),
    "terraces": Family("one house again and again in a row", Terraces.draw, held_out=True),
}
