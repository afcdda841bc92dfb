"""The work of one request: from its models to the libraries, and from their results to JSON."""
