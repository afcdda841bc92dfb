"""Maps of other tools that come over HTTP, read in a process of their own that can take only so much.

::

    bounded    has a child process of service/parsing read, and takes its answer
    folders    where the files of one import are put, and when they go
    reader     what runs in it: from a form to a map and a report
    form       multipart/form-data to files and fields
    fields     fields to the options of `formats` for a file
"""
