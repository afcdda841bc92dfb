"""Admission of requests.

The service decides about a request once, from its head (`Entrance.admit`). The decision travels with the request as a
`Ticket`: the caller's key, and the place on the way to a search. The `Gate` takes the ticket for each slot.
"""
