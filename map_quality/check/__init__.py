"""What is doubtful in a map, by itself and with sample scans."""
