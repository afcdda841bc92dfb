"""The command line ``linefix``: one module a command, each of which works in the process or asks a server.

::

    entry                          runs a command, and turns what goes wrong into one line and an exit code
    program                        all commands, put together
    locate, replay, analyze, batch, register, vectorize, key, ros2, maps/    the commands
    logs, tracking                 a log's scans to requests; what is known of the next pose
    all_cores                      places of an analysis, tried by several processes
    contract                       what commands ask for, and in which form
    answering, in_process, server  who answers: this process, or a server
    keeping, stored                who has the stored maps: a server, or the store of this machine
    compiling                      kernels that are not cached, before the first search
    inputs, printing               files to requests, answers to people
    options, grouping              options of several commands; those that belong together
"""
