"""Work for one request, in a thread: from its models to the libraries, and from their results to JSON.

This package does not depend on HTTP: a route hands over a checked request and a `Job`, and gets `Done` back.
"""
