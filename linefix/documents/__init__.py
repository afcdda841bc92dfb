"""Requests and answers as documents: each declared once, for HTTP, files and the command line."""
