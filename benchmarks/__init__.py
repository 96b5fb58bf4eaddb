"""Speed and step-size measurements; `python -m benchmarks.run` prints the table of `make bench`."""
