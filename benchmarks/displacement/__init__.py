"""What displacement is worth: trade-off of error, pressure, efficiency in a calm sea and travel of the swash plates, of
SSC, strong SSC, displacement by an optimum and FF: `python -m benchmarks.displacement`, see
docs/validation/displacement-tradeoff.md."""

from pathlib import Path

OUTCOME = Path(__file__).with_name("outcome.json")
