"""Who is let in: keys, a fair queue, one ticket per request."""
