"""The service over HTTP: routes, problems, bodies, the log of requests."""
