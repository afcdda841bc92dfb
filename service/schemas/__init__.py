"""Requests and responses of the HTTP contract, as pydantic models."""
