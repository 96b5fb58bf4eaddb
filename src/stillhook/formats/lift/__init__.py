"""What a lift file is made of: its tables, the place that they describe, and its old forms."""
