"""What a plan answers beyond its limits: reference cell, sensitivity, remarks, metadata, files."""
