"""Mutation testing: small changes of numbers and comparisons in the sources, drawn by a seed, and whether the tests
notice each (docs/decisions/0039-mutation-testing.md)."""
