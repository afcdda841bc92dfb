"""The service: registration and association over HTTP."""
