"""Clients of the service, and what is made for them."""
