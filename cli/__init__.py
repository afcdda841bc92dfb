"""The command line ``linefix``: one module for each command, which computes with `linefix` or sends to a server.

::

    entry                     run a command; errors become one line and an exit code
    program                   all commands together
    locate, register, vectorize, replay, batch, analyze, key, ros2, maps/    the commands
    asking                    where a request goes: to a server, or to this process
    here                      answers of this process, by `linefix`
    server                    answers of a server, by `linefix-client`
    stored                    the store of maps of this machine
    contract                  the form of requests
    inputs, scans, logs       files to requests
    locators, tracking, frames    scans of a log to poses: search, prior, mount
    all_cores                 the places of an analysis in several processes
    compiling                 kernels that are not cached, before the first search
    options, printing         options of several commands; answers for people
"""
