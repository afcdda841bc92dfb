"""Admission of requests.

The service decides about a request once, from its head (`Entrance.admit`). The decision travels with the request as a
`Ticket`: the caller's key, and its place among those that search. The `Gate` takes the ticket for each slot.
"""
