"""Compiled parts of the search. They validate nothing and speak in the records of `association.layout`.

Every kernel has a slow, obviously right twin in ``tests/association/reference``.
"""
