"""The command line ``linefix``: commands, which compute with `linefix` or send to a server.

::

    entry                     run a command; errors become one line and an exit code
    program                   all commands together; those of the service
    one_scan, replay, batch, analyze, ros2, maps/    the commands
    asking                    the service to ask: a server by `linefix-client`, or `linefix.answering` and the store
    stored                    the store of maps of this machine
    inputs, logs              files to requests; a robot along a log: frames, prior
    options, printing         options of several commands; answers and progress for people
"""
