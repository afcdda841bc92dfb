"""The service: registration and association over HTTP.

Each room imports only from those below it; import-linter holds them to that (`pyproject.toml`).

::

    serving                starts the service, and drains it before it ends
    app                    the application: its layers, its routes, its start and end
    http/                  routes, problems, bodies, the log of requests
    services, readiness    the parts of one application, put together; whether it can serve
    work/                  one request's work in a thread: models to the libraries, results to JSON
    settings               command line and environment
    admission/, maps/      who is let in; stored maps and their indices
    importing/             maps of other tools, read in a process with bounds of its own
    parsing/               from the bytes of a body to a checked request, large ones in another process
    telemetry/             counts and the log
    page/                  the files of the page at /, built
    database_location, errors, memory, thread_pool, version
"""
