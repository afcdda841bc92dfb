"""What is doubtful in a map, and where on it localization fails."""
