"""Open benchmark of controllers: `python -m benchmarks.control [--entry FILE] [--quick] [--json]`, see
docs/how-to/enter-the-benchmark.md."""
