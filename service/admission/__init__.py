"""Who is let in.

A request is decided upon once, from its head (`Entrance.admit`). What was decided travels with it as a `Ticket`: whose
key it came with, and its place on the way to a search. The `Gate` takes the ticket for each slot.
"""
