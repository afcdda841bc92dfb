"""The command line ``linefix``: one module for each command, which computes with `linefix` or sends to a server.

::

    entry                     run a command; errors become one line and an exit code
    program                   all commands together
    locate, register, vectorize, replay, batch, analyze, ros2, maps/    the commands
    asking                    where a request goes: to a server by `linefix-client`, or to `linefix.answering`
    stored                    the store of maps of this machine
    inputs, scans, logs       files to requests
    tracking, frames          a robot along a log: prior, maps, mount
    compiling                 kernels that are not cached, before the first search
    options, printing         options of several commands; answers for people
"""
