"""What the HTTP contract takes and gives, as pydantic models."""
