"""Mutation tests: changes of the code that the tests must notice, run by Cosmic Ray."""
